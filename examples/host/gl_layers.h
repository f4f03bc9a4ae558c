/* Layers and depth meshes by OpenGL: records scenery between the borders of its layers, and draws
   what is left of it from one atlas. It needs desktop OpenGL. */
#ifndef HOST_GL_LAYERS_H
#define HOST_GL_LAYERS_H

#include "gl_terrain.h"

/* What stands for a piece of scenery. */
typedef struct gl_layers_picture {
    terrimp_layers layers;   /* from terrimp_layers_plan */
    terrimp_capture capture; /* a whole number of texels wide and high */
    int as_mesh;             /* nonzero: a depth mesh, for flat walls; 0: quads of layers */
    GLint first;             /* out: vertices in the array */
    GLsizei count;
} gl_layers_picture;

/* A quad or a sheet of a mesh, until all are packed. */
typedef struct gl_layers_part {
    struct gl_layers_part *next;
    terrimp_layer_quad quad;
    uint32_t count, *texels; /* vertices; [height][width] RGBA */
    float *vertices;         /* [count][8] position, texel of the picture, position for depth */
} gl_layers_part;

typedef struct gl_layers {
    uint32_t quad_cost;      /* as in terrimp_cover_desc */
    gl_layers_part *parts, **last;
    uint32_t part_count, vertex_count;
    size_t texel_count;
    gl_program program;
    GLuint atlas, array, vertices;
    context frame;           /* into which layers are drawn */
    terrimp_result result;   /* the first error; later calls return it, too */
} gl_layers;

/* Draws the scenery that meets a slab, from the eye of its capture between its z_near and z_far. */
typedef void (*gl_layers_scenery)(void *user, const terrimp_capture *slab);

/* For pictures up to `side` pixels wide and high. Returns null, or one line that says what is
   wrong; to be closed in either case. */
const char *gl_layers_open(gl_layers *g, uint32_t side, uint32_t quad_cost);

/* Records a picture: calls back twice for each layer, the second time for outlines. All texels are
   kept until they are packed. The depth test is on afterwards, and another framebuffer bound.
   E_MEMORY; E_CAPACITY when a layer takes more than 4096 quads, or a mesh is too large. */
terrimp_result gl_layers_record(gl_layers *g, gl_layers_picture *p, gl_layers_scenery draw,
                                void *user);

/* Packs all that was recorded into an atlas so wide and high. Nothing is recorded after it.
   E_MEMORY; E_CAPACITY when it does not fit. */
terrimp_result gl_layers_pack(gl_layers *g, uint32_t side);

/* Draws a picture with the program, which the caller has in use with its matrix set. */
void gl_layers_draw(const gl_layers *g, const gl_layers_picture *p);

void gl_layers_close(gl_layers *g);

#endif
