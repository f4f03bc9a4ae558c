#include "hud.h"

#include "gl_terrain.h"

#include <ctype.h>
#include <stddef.h>
#include <string.h>

static const char vertex[] = GL_SHADER_HEAD
    "layout(location = 0) in vec4 corner;\n" /* x, y, u, v */
    "layout(location = 1) in vec4 paint;\n"
    "uniform vec2 size;\n"
    "out vec2 uv;\n"
    "out vec4 tint;\n"
    "void main() {\n"
    "    uv = corner.zw;\n"
    "    tint = paint;\n"
    "    gl_Position = vec4(vec2(2.0, -2.0) * corner.xy / size + vec2(-1.0, 1.0), 0.0, 1.0);\n"
    "}\n";

static const char fragment[] = GL_SHADER_HEAD
    "uniform sampler2D picture;\n"
    "uniform float textured;\n"
    "in vec2 uv;\n"
    "in vec4 tint;\n"
    "out vec4 colour;\n"
    "void main() {\n"
    "    vec4 c = textured > 0.0 ? texture(picture, uv) : vec4(1.0);\n"
    "    colour = c * vec4(tint.rgb * tint.a, tint.a);\n"
    "}\n";

/* Five rows of three dots, each row an octal digit. */
static const char letters[] = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZ.,:%/-+()=?_<>[]";
static const uint16_t dots[] = {
    075557, 026227, 071747, 071717, 055711, 074717, 074757, 071111, 075757, 075717,
    025755, 065656, 034443, 065556, 074647, 074644, 034553, 055755, 072227, 011152, 055655, 044447,
    057755, 065555, 025552, 065644, 025563, 065655, 034216, 072222, 055557, 055552, 055775, 055255,
    055222, 071247, 000002, 000024, 002020, 051245, 011244, 000700, 002720, 024442, 021112, 007070,
    071202, 000007, 012421, 042124, 064446, 031113
};

const char *hud_open(hud *h)
{
    memset(h, 0, sizeof *h);
    h->program = gl_program_make(vertex, fragment).id;
    if (!h->program)
        return "a shader does not compile";
    h->size = glGetUniformLocation(h->program, "size");
    h->textured = glGetUniformLocation(h->program, "textured");
    glGenVertexArrays(1, &h->array);
    glBindVertexArray(h->array);
    glGenBuffers(1, &h->vertices);
    glBindBuffer(GL_ARRAY_BUFFER, h->vertices);
    gl_point(0, 4, GL_FLOAT, sizeof(hud_corner), 0);
    glEnableVertexAttribArray(1);
    glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(hud_corner),
                          (const void *)offsetof(hud_corner, colour));
    return NULL;
}

void hud_begin(hud *h, const context *frame)
{
    h->width = frame->width;
    h->height = frame->height;
    h->count = 0;
}

static void send(hud *h, float textured)
{
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glDisable(GL_SCISSOR_TEST);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    glUseProgram(h->program);
    glUniform2f(h->size, (float)h->width, (float)h->height);
    glUniform1f(h->textured, textured);
    glBindVertexArray(h->array);
    glBindBuffer(GL_ARRAY_BUFFER, h->vertices);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)((size_t)h->count * sizeof *h->corners), h->corners,
                 GL_STREAM_DRAW);
    glDrawArrays(GL_TRIANGLES, 0, h->count);
    glDisable(GL_BLEND);
    h->count = 0;
}

void hud_bar(hud *h, float x, float y, float width, float height, uint32_t colour)
{
    int i;
    if (h->count + 6 > HUD_CORNERS)
        send(h, 0.0f);
    for (i = 0; i < 6; i++) {
        hud_corner *c = &h->corners[h->count++];
        c->u = i == 1 || i == 2 || i == 4 ? 1.0f : 0.0f;
        c->v = i == 2 || i == 4 || i == 5 ? 0.0f : 1.0f;
        c->x = x + c->u * width;
        c->y = y + (1.0f - c->v) * height;
        c->colour[0] = (uint8_t)(colour >> 24);
        c->colour[1] = (uint8_t)(colour >> 16 & 255u);
        c->colour[2] = (uint8_t)(colour >> 8 & 255u);
        c->colour[3] = (uint8_t)(colour & 255u);
    }
}

float hud_text(hud *h, float x, float y, float dot, uint32_t colour, const char *text)
{
    for (; *text; text++, x += 4.0f * dot) {
        const char *found = strchr(letters, toupper((unsigned char)*text));
        int i;
        for (i = 0; found && i < 15; i++)
            if (dots[found - letters] >> (14 - i) & 1)
                hud_bar(h, x + (float)(i % 3) * dot, y + (float)(i / 3) * dot, dot, dot, colour);
    }
    return x;
}

void hud_texture(hud *h, float x, float y, float side, GLuint texture)
{
    if (h->count)
        send(h, 0.0f);
    hud_bar(h, x, y, side, side, 0xffffffffu);
    glBindTexture(GL_TEXTURE_2D, texture);
    send(h, 1.0f);
}

void hud_end(hud *h)
{
    if (h->count)
        send(h, 0.0f);
}

void hud_close(hud *h)
{
    glDeleteProgram(h->program);
    glDeleteVertexArrays(1, &h->array);
    glDeleteBuffers(1, &h->vertices);
    memset(h, 0, sizeof *h);
}
