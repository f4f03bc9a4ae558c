/* The OpenGL side of the draw commands: buffers, textures, shaders and the four callbacks. */
#ifndef HOST_GL_TERRAIN_H
#define HOST_GL_TERRAIN_H

#include "context.h"
#include "terrimp.h"

/* A shader program with the places of its uniforms; -1 where it lacks one. */
typedef struct gl_program {
    GLuint id;
    GLint matrix, eye;               /* all: positions are taken relative to the eye */
    GLint field;                     /* ground: world x, z to lightmap coordinates */
    GLint alpha;                     /* impostors: the share of the pixels */
    GLint morph, side, side_coarse;  /* morphing ground */
    GLint texture_matrix, picture_eye; /* impostors */
    GLint depth_matrix, ray, picture_slot; /* impostors with exact depth */
    GLint sun, sun_colour, sky_colour; /* ground with normals */
    GLint tint;                      /* lines: blue for ground, red for coarse meshes */
    GLint on_screen;                 /* terrain: 0 in a capture, 1 on the screen */
} gl_program;

/* Vertices of ground as they are, and morphing ones by the formula of terrimp_geomip_weights. */
extern const char gl_ground_vertex[], gl_morphing_vertex[];

/* A pixel's threshold, 0..1, for what shows on a share of the pixels. Multiples of the inverse of
   1.3247, the root of x^3 = x + 1, and of its square: they spread evenly over any small part of
   the plane. */
#define GL_THRESHOLD                                                                       \
    "float threshold() {\n"                                                                \
    "    return fract(dot(floor(gl_FragCoord.xy), vec2(0.754877666, 0.569840291)));\n"      \
    "}\n"

/* Opaque ground with no shading but the lightmap at `uv`; and outlines. */
extern const char gl_ground_fragment[], gl_line_fragment[];

/* Makes a program whose input `position` is at location 0; the id is 0 when it does not compile. */
gl_program gl_program_make(const char *vertex_source, const char *fragment_source);

/* Uses a program with a matrix for positions relative to the eye. */
void gl_program_use(const gl_program *p, const float matrix[16], const float eye[3], int on_screen);

/* That matrix, column-major: of the view only the turn is left. */
void gl_relative_matrix(const float view[16], const float projection[16], float out[16]);

/* Makes and binds a vertex array and a buffer of vertices; NULL: only room for them. */
GLuint gl_array_make(GLuint *buffer, const void *data, size_t bytes);

/* Enables an attribute of the bound vertex array and points it into the bound buffer. */
void gl_point(GLuint location, GLint size, GLenum type, size_t stride, size_t offset);

/* Texture units: of the depth of atlases, of the ground's normals, and of those in atlases. */
enum { GL_DEPTH_UNIT = 8, GL_NORMAL_UNIT, GL_ATLAS_NORMAL_UNIT };

enum { GL_TO_FRAME = -1, GL_TO_NOTHING = -2 };

/* What may be drawn over a frame: outlines, or its pixels tinted by the level of what drew them. */
typedef enum gl_over { GL_OVER_NOTHING, GL_OVER_LINES, GL_OVER_LEVELS } gl_over;

/* Outlines of what is in a pool. */
typedef struct gl_lines {
    GLuint array, indices;
} gl_lines;

/* Ground draws of one state, waiting to be sent as one call. */
enum { GL_BATCH = 256 };
typedef struct gl_batch {
    GLsizei counts[GL_BATCH];
    const void *offsets[GL_BATCH];
    GLint base_vertices[GL_BATCH];
    GLsizei count;
} gl_batch;

struct gl_terrain;

/* Slots of one size in a pair of buffers, for what nodes are drawn from: as many nodes as fit,
   those that were drawn last. */
typedef struct gl_pool {
    terrimp_result (*send)(struct gl_terrain *g, uint32_t node, uint32_t slot);
    GLuint array, vertices, indices;
    uint32_t node_vertices, node_indices; /* of a slot; 0 indices: all share some */
    uint32_t slot_count, node_count;
    uint32_t filled;                 /* slots that have been filled so far */
    uint32_t *slot_of;               /* [node_count] UINT32_MAX: not there */
    uint32_t *node_of, *used;        /* [slot_count] node, and frame that drew it last */
} gl_pool;

/* Where an impostor's picture lies, and whether it showed when it was last drawn. */
typedef struct gl_sight {
    GLuint query;
    uint32_t frame; /* that drew it last; 0: none has */
    int hidden, asked;
    terrimp_rect slot;
} gl_sight;

enum { GL_ATLASES = 16 };

/* What a terrain is drawn with. The lightmap lies over the whole terrain; its field is the
   terrain's, or for less memory one of every n-th sample. */
typedef struct gl_terrain_desc {
    const context *frame;
    const terrimp_terrain *terrain;   /* built; outlives what is opened */
    const terrimp_heightfield *field; /* of the lightmap */
    const uint8_t *lightmap;          /* rgb[depth][width][3] of the field's size */
    uint32_t atlas_size;
    size_t vertex_bytes;              /* of graphics memory, for ground [Default 0 -> 400 MiB] */
    size_t mesh_bytes;                /* and for coarse meshes [Default 0 -> 16 MiB] */
    int exact_depth;                  /* as in the settings of the view */
    const uint8_t *normals;           /* [depth][width][2] of terrimp_normal_encode: the ground is
                                         lit by gl_terrain_light. NULL: as the lightmap is */
    int relit;                        /* with normals: pictures keep colours without light, and
                                         normals; they are lit when they are drawn */
    const char *shading;              /* GLSL that defines, beside `uniform sampler2D lightmap`:
                                         vec3 shade(vec2 uv, vec3 position)
                                           the colour of the ground, which pictures keep
                                         vec3 shadow(vec3 colour, vec3 position)
                                           what moves over it, which pictures leave out
                                         uv: of the lightmap; position [wu]. It outlives what is
                                         opened [Default null -> the lightmap alone] */
} gl_terrain_desc;

typedef struct gl_terrain {
    const context *frame;
    const terrimp_terrain *terrain;
    const char *shading;
    gl_pool ground_pool, mesh_pool;  /* behind the slots of meshes stands the floor */
    size_t floor_vertices, floor_indices;
    uint32_t floor_first_index; /* of commands */
    uint32_t frame_number;
    GLuint morphing_array, moves, weights; /* with morphing */
    float *xyz;                      /* of one node, to be sent, like the next two */
    uint16_t *indices;
    terrimp_geomip_vertex *morph;
    GLuint lightmap, normals;
    float light[3][3];               /* way to the sun, its colour, that of the sky */
    GLsizei atlas_size;
    GLuint atlas[GL_ATLASES], atlas_frame[GL_ATLASES]; /* made when they are first used */
    GLuint atlas_depth;              /* one depth buffer serves all; or, for exact depth, */
    GLuint atlas_depths[GL_ATLASES]; /* ... each has a texture of its own */
    GLuint atlas_normals[GL_ATLASES]; /* of pictures that are lit when drawn */
    int exact_depth, relit;
    gl_program ground, morphing, impostor, line;
    gl_program deep;                 /* impostors with exact depth; */
    gl_sight *sights;                /* ... [node_count][2] of each part */
    float camera_matrix[16], camera_eye[3];
    float field[4];                  /* x, z scale and offset of the lightmap coordinates */
    gl_batch batch;
    uint8_t sky[3];
    int target;                      /* where draws go: an atlas, GL_TO_FRAME or GL_TO_NOTHING */
    int cleared;                     /* the frame has been cleared */
    int capturing;                   /* between begin and end of a capture */
    gl_over over;                    /* draw that over the frame, and no captures */
    gl_lines ground_lines, mesh_lines; /* made when they are first wanted */
} gl_terrain;

/* Fills buffers and textures. Returns null, or one line that says what is wrong; then there is
   nothing to close. */
const char *gl_terrain_open(gl_terrain *g, const gl_terrain_desc *desc);

/* Prepares for ground commands that morph. Returns null, or what is wrong. */
const char *gl_terrain_use_morphing(gl_terrain *g);

/* After an edit: sends a node's ground and its coarse mesh anew; with the number of nodes for a
   node, the floor. */
terrimp_result gl_terrain_refill(gl_terrain *g, uint32_t node);

/* Another lightmap of the same field. Returns 0 when memory runs out. Pictures keep the old light
   until terrimp_view_invalidate. */
int gl_terrain_relight(gl_terrain *g, const terrimp_heightfield *field, const uint8_t *lightmap);

/* With normals: the light of the frames that follow: [0] the unit vector towards the sun, [1] its
   colour on ground that faces it, [2] what the sky gives all ground. */
void gl_terrain_light(gl_terrain *g, const float light[3][3]);

/* Starts a frame: clears it to the sky's colour and takes the camera's matrices. */
terrimp_result gl_terrain_begin(gl_terrain *g, const terrimp_camera *camera,
                                const uint8_t sky[3]);

/* Sends what follows to the frame, which is cleared the first time. For draws of one's own. */
void gl_terrain_turn_to_frame(gl_terrain *g);

/* The callbacks for terrimp_view_render, with g as their user pointer. */
terrimp_callbacks gl_terrain_callbacks(gl_terrain *g);

/* Sends what is waiting and waits until the frame is drawn. */
void gl_terrain_end(gl_terrain *g);

/* The same without waiting, for frames that go to a window. */
void gl_terrain_send(gl_terrain *g);

/* A colour for a level, each component 0 to 1. */
const float *gl_level_colour(uint32_t level);

/* Draws the view once more over the frame, as lines (blue for ground, red for coarse meshes) or in
   the colours of the levels. Its captures are not repeated. */
terrimp_result gl_terrain_draw_over(gl_terrain *g, terrimp_view *view, gl_over over);

/* Lines, and waits for them. */
terrimp_result gl_terrain_wireframe(gl_terrain *g, terrimp_view *view);

/* Copies an atlas to rgb[atlas_size][atlas_size][3], row 0 of the texture first; what is
   transparent becomes grey. Returns 0 when memory runs out. */
int gl_terrain_read_atlas(const gl_terrain *g, int atlas, uint8_t *rgb);

void gl_terrain_close(gl_terrain *g);

#endif
