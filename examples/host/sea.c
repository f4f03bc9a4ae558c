#include "sea.h"

#include <string.h>

static const char vertex[] = GL_SHADER_HEAD
    "layout(location = 0) in vec3 position;\n"
    "uniform mat4 matrix;\n"
    "uniform vec3 eye;\n"
    "out vec3 towards;\n"
    "void main() {\n"
    "    towards = position - eye;\n"
    "    gl_Position = matrix * vec4(towards, 1.0);\n"
    "}\n";

/* Seen from above it is clear, at a low angle it shines like the sky. */
static const char fragment[] = GL_SHADER_HEAD
    "uniform vec3 light;\n"
    "in vec3 towards;\n"
    "out vec4 colour;\n"
    "void main() {\n"
    "    float flat_on = abs(normalize(towards).y), shine = pow(1.0 - flat_on, 4.0);\n"
    "    colour = vec4(light * mix(vec3(0.10, 0.25, 0.36), vec3(0.60, 0.72, 0.84), shine),\n"
    "                  0.70 + 0.25 * shine);\n"
    "}\n";

const char *sea_open(sea *s, const terrimp_box *box, float height)
{
    float width = box->max[0] - box->min[0], depth = box->max[2] - box->min[2], xyz[4][3];
    int i;
    memset(s, 0, sizeof *s);
    for (i = 0; i < 4; i++) {
        xyz[i][0] = box->min[0] + width * (i % 2 ? 9.0f : -8.0f);
        xyz[i][1] = height;
        xyz[i][2] = box->min[2] + depth * (i / 2 ? 9.0f : -8.0f);
    }
    s->program = gl_program_make(vertex, fragment);
    if (!s->program.id)
        return "a shader does not compile";
    glUseProgram(s->program.id);
    glUniform3f(glGetUniformLocation(s->program.id, "light"), 1.0f, 1.0f, 1.0f);
    s->array = gl_array_make(&s->vertices, xyz, sizeof xyz);
    gl_point(0, 3, GL_FLOAT, 0, 0);
    return NULL;
}

void sea_draw(const sea *s, const gl_terrain *g)
{
    gl_program_use(&s->program, g->camera_matrix, g->camera_eye, 1);
    glBindVertexArray(s->array);
    glDisable(GL_CULL_FACE); /* an eye below it sees it, too */
    glEnable(GL_BLEND);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    glDisable(GL_BLEND);
    glEnable(GL_CULL_FACE);
}

void sea_close(sea *s)
{
    glDeleteProgram(s->program.id);
    glDeleteVertexArrays(1, &s->array);
    glDeleteBuffers(1, &s->vertices);
    memset(s, 0, sizeof *s);
}
