/* The OpenGL side of the draw commands: buffers, textures, shaders and the four callbacks. */
#ifndef HOST_GL_TERRAIN_H
#define HOST_GL_TERRAIN_H

#include "context.h"
#include "terrimp.h"

/* A shader program with the places of its uniforms; -1 where it lacks one. */
typedef struct gl_program {
    GLuint id;
    GLint matrix, eye, scale;        /* all: vertices are drawn at eye + (p - eye) * scale */
    GLint field;                     /* ground: world x, z to lightmap coordinates */
    GLint fade;                      /* fading ground: alpha = x - y * distance */
    GLint texture_matrix;            /* impostors */
    GLint tint;                      /* lines: blue for ground, red for coarse meshes */
} gl_program;

/* The shading of opaque ground, alike in every mode: the lightmap at `uv`. */
extern const char gl_ground_fragment[];

/* Makes a program whose input `position` is at location 0; the id is 0 when it does not compile. */
gl_program gl_program_make(const char *vertex_source, const char *fragment_source);

enum { GL_TO_FRAME = -1, GL_TO_NOTHING = -2 };

/* Ground draws of one state, waiting to be sent as one call. */
enum { GL_BATCH = 256 };
typedef struct gl_batch {
    GLsizei counts[GL_BATCH];
    const void *offsets[GL_BATCH];
    GLint base_vertices[GL_BATCH];
    GLsizei count;
    float fade_start, fade_end, depth_bias;
} gl_batch;

typedef struct gl_terrain {
    const context *frame;
    uint32_t chunk_vertices;         /* of one chunk's ground */
    GLuint ground_array, ground_vertices, ground_indices;
    GLuint mesh_array, mesh_vertices, mesh_indices;
    GLuint lightmap;
    GLsizei atlas_size;
    GLuint atlas[2], atlas_frame[2], atlas_depth; /* one depth buffer serves both */
    gl_program ground, fading, impostor, line;
    float camera_matrix[16], camera_eye[3];
    float field[4];                  /* x, z scale and offset of the lightmap coordinates */
    gl_batch batch;
    uint8_t sky[3];
    int target;                      /* where draws go: an atlas, GL_TO_FRAME or GL_TO_NOTHING */
    int cleared;                     /* the frame has been cleared */
    int capturing;                   /* between begin and end of a capture */
    int lines;                       /* draw outlines, and no captures */
} gl_terrain;

/* Fills the buffers of a built terrain. The lightmap is rgb[depth][width][3] of the field's size.
   Returns null, or one line that says what is wrong; then there is nothing to close. */
const char *gl_terrain_open(gl_terrain *g, const context *frame, const terrimp_terrain *terrain,
                            const terrimp_heightfield *field, const uint8_t *lightmap,
                            uint32_t atlas_size);

/* Starts a frame: clears it to the sky's colour and takes the camera's matrices. */
terrimp_result gl_terrain_begin(gl_terrain *g, const terrimp_camera *camera,
                                const uint8_t sky[3]);

/* Sends what follows to the frame, which is cleared the first time. For draws of one's own. */
void gl_terrain_turn_to_frame(gl_terrain *g);

/* The callbacks for terrimp_view_render, with g as their user pointer. */
terrimp_callbacks gl_terrain_callbacks(gl_terrain *g);

/* Sends what is waiting and waits until the frame is drawn. */
void gl_terrain_end(gl_terrain *g);

/* Draws the view's triangles as lines over the frame. Its captures are not repeated. */
terrimp_result gl_terrain_wireframe(gl_terrain *g, terrimp_view *view);

/* Copies an atlas to rgb[atlas_size][atlas_size][3], row 0 of the texture first; what is
   transparent becomes grey. Returns 0 when memory runs out. */
int gl_terrain_read_atlas(const gl_terrain *g, int atlas, uint8_t *rgb);

void gl_terrain_close(gl_terrain *g);

#endif
