/* terrimp.h - v0.5.0 - draws large heightfield terrain with terrain impostors - MIT licence

   Distant terrain is drawn as pictures of itself: a node of a quadtree is rendered in full detail
   into a slot of a texture atlas, and for many frames after that a coarse mesh of under a hundred
   triangles wears the picture in its place. Close terrain is drawn as geometry, with geometrical
   mipmapping; and so is what a picture would not pay for. This header decides what to draw; the
   host draws it, through callbacks, with whatever graphics it has.

   QUICK START. In one C or C++ file define TERRIMP_IMPLEMENTATION before including the header;
   include it plainly elsewhere. A whole program. Example:

        #define TERRIMP_IMPLEMENTATION
        #include "terrimp.h"

        static float heights[129 * 129];
        static void capture(void *user, const terrimp_capture_command *c) { (void)user, (void)c; }
        static void impostor(void *user, const terrimp_impostor_command *c) { (void)user, (void)c; }
        static void ground(void *user, const terrimp_ground_command *c) { (void)user, (void)c; }

        int main(void)
        {
            terrimp_terrain_desc desc = {0};   // zero means the default, in every descriptor
            terrimp_view_desc settings = {0};
            terrimp_camera camera = {0};
            terrimp_callbacks draw = {0};
            terrimp_terrain *terrain;
            terrimp_view *view;
            desc.field.samples = heights;
            desc.field.width = desc.field.depth = 129;
            if (terrimp_terrain_create(&desc, NULL, &terrain)) return 1;
            if (terrimp_view_create(terrain, &settings, NULL, &view)) return 1;
            draw.begin_capture = draw.end_capture = capture;
            draw.draw_impostor = impostor, draw.draw_ground = ground;
            camera.eye[1] = 100, camera.forward[2] = 1, camera.forward[1] = -1;
            camera.width_px = 640, camera.height_px = 480, camera.z_near = 1, camera.z_far = 9999;
            if (terrimp_view_update(view, &camera)) return 1;   // once a frame
            return terrimp_view_render(view, &draw);            // calls the functions above
        }

   CONTENTS
       >>config       compile-time switches, version
       >>basics       result codes, boxes
       >>heightfield  a view of the caller's samples; heights, normals, rays
       >>camera       the frame's camera, culling, the frustum fitted to a box
       >>quadtree     which node: its place, box, parent, neighbours, children closest first
       >>geomipmap    levels, crack-free index patterns, selection, morphing
       >>impostor     size in texels, texture matrix, view angle, parallax error, lifetime
       >>atlas        first-fit decreasing height packing; an atlas whose slots come and go
       >>terrain      what was built, as the frame and the host's buffers use it
       >>bake         what was built as one block: for a file, for read-only memory
       >>visibility   which nodes are hidden behind others: the horizon, visible sets
       >>residency    terrain larger than memory: which pages are here
       >>capture      a picture to be made, and the ground that is drawn for it
       >>view         the per-frame decision, the schedule, the draw commands
       >>sorted       terrain in exact painter's order, for machines without a depth buffer
       >>layers       pictures one behind the other, of what stands on terrain
   and, for those that build terrains and do not only draw them, behind one TERRIMP_NO_BUILD:
       >>simplifier   coarse meshes: borders, collapses, skirts, standing proud
       >>builder      filling of voids, errors of the ground, coarse meshes, edits, materials, bakes
       >>page-builder pages of a terrain from samples that are larger than memory
       >>visible-sets what a horizon is made of, and what can be seen from where
       >>layer-builder  where layers stand, what of them is hidden, rectangles that hold the rest;
                        depth meshes
       >>placement    which pictures to prepare so that no view costs too much
   The implementation has the same sections in the same order, tagged impl-. Each uses only
   those above it, and each works alone: a packer or a simplifier is all that some hosts want.

   DOES NOT
       call a graphics API, load files, print, read a clock, start threads, allocate after create;
       keep textures or vertex buffers (it fills the host's); light the terrain (the host's shader
       does, in captures as on the screen); read files: of a terrain that is larger than memory it
       says which pages it wants.

   CONVENTIONS
       y is up, axes are right-handed, samples lie row by row: columns along +x, rows along +z.
       A quad is cut from (x, z) to (x + 1, z + 1). Triangles wind counter-clockwise from above.
       Matrices are column-major, for column vectors. Angles are radians. [wu] is the world's unit
       of length, [px] a pixel; [Limits] and [Default] are checked by tests. Row 0 of a texture is
       t = 0; a texel's value stands for its centre. Clip depth is -1..1, or 0..1 when the camera
       says so. Nothing is called near or far, since windows.h makes macros of these.

   PIPELINE
       once    heightfield -> errors of the ground -> coarse meshes with skirts -> (bake)
                 -> the host's buffers
       frame   camera -> cull -> where the ground's level changes, where impostors could stand
                 -> for each part what costs less: ground or impostors?
                 -> is its picture still good? -> else a capture, as the schedule allows
                 -> commands

              eye           fade_start    fade_end
               o=================|-------------|- - - - - - - - - - - - - - - ->
                 ground           impostors       impostors of growing nodes,
                                  fade in         or ground where that is cheaper

       A picture is renewed when the direction to the node has turned by max_angle_rad, when the
       parallax error could pass tolerance_px, or when the node has come so close that texels would
       show. It is made from a place ahead of the eye, where it lasts longer. What waits for its
       picture is drawn from those of its children or its parent, or as ground.

       In the fade band a node is drawn as ground and, on a growing share of the pixels, as the
       impostor, whose mesh stands just above that ground. So all lies at its own depth, and water,
       houses and shadows meet it there.

               picture in the atlas             coarse mesh, a little proud of the terrain
              +--------------------+                 .--'`--.__
              |  sky: transparent  |               .'  terrain `-._
              |   __/\__    _      | projected    /________________\
              |__/      \__/ \_____| ---------->  |                |
              |  + a border of the |              |  lower skirt   |
              |  next nodes        |
              +--------------------+

   IN A SCENE
       Captures are drawn as the frame's opaque ground is: back faces culled, no blending, not the
       frame's scissor, alpha 1 written; what stands still may be drawn into them beside the ground,
       cut to the clip rectangle. Whatever depends on the frame's eye or on time stays out of them:
       specular light, fog, moving shadows; fog comes on impostors when these are drawn. An sRGB
       atlas is filtered rightly; captures need no multisampling where the screen has it. On the
       screen all is opaque and at its own depth: the sky goes before or after, transparent things
       after.

   MEMORY
       The caller owns it. terrimp_terrain_bytes and terrimp_view_bytes say how much; init lays
       everything out in one block and nothing is allocated afterwards. create does the same over
       malloc or an allocator of yours. With default settings a terrain takes about 520 bytes a
       node: 690 for each 64 x 64 quads, 0.17 bytes a sample. A view takes about 470 bytes for each
       picture it may keep, 120 for each ground node it may draw and 23 for each node of the
       terrain. Samples are used where they lie; what is built can lie in read-only memory, as a
       bake: then a terrain takes 1 KiB. Of a terrain in pages there are as many slots of 9 KiB in
       memory as the host likes, and 2 bytes a node. Building takes 200 KiB and 4 bytes a column for
       each thread. Outside of it, a host that keeps the ground of all nodes as floats needs 16
       bytes a sample, much less if it makes that as it is drawn, and for coarse meshes 103 vertices
       and 543 indices a node.

   ERRORS
       Functions that can fail return a terrimp_result, 0 when all is well, and leave their outputs
       as they were unless their comment says otherwise. Any of them may return, in every build,
       and their comments do not repeat it:
         E_NULL                a pointer is null that is not said to be optional
         E_RANGE, E_NOT_FINITE a number is outside of its limits, or NaN or infinite
         E_OVERFLOW, E_MEMORY  sizes multiply to more than size_t holds; a block is too small
         E_ALIGN, E_CAPACITY   a pointer is not aligned for its type; an output array is too small
         E_STATE               an object is not ready: before init, build_finish, the first update
       Asserts are for this header's own mistakes. terrimp_result_text says what to do.

   THREADS AND DETERMINISM
       No globals, no statics that change. Nodes may be built by several threads at once, each
       with its own scratch, to the same bytes; a built terrain may be read by any number of views
       on any threads; one view belongs to one thread at a time. The same input gives the same
       commands, bit for bit, on one compiler with the same floating-point options.

   LIMITS
       Heightfields of 2 x 2 to 65537 x 65537 samples, any width and depth. No caves, no overhangs.
       A picture shows a hidden slope with the ridge before it smeared over it once the eye has
       moved; max_angle_rad bounds how far that goes, and pictures in two parts spare the worst.
       What moves on the terrain belongs into the host's own draws, not into captures. Ground and
       impostors of one place are alike to within the tolerances, not to the bit: where a node
       changes from one to the other beyond the fade band, that much can be seen to change. From
       under the terrain no floor is drawn, and from beside it no more than is hidden by ground,
       since it would show where the sky is.

   PORTING
       Needs a C99 or C++98 compiler with stdint.h, and memcpy, memset, memmove, memcmp, memchr.
       Macros, to be defined before the implementation is included:
         TERRIMP_STATIC        functions are static: for one file alone (also before the API)
         TERRIMP_API           their linkage, when that is not enough (also before the API)
         TERRIMP_ASSERT(c)     instead of assert.h
         TERRIMP_SQRTF and SINF, COSF, TANF, ASINF, ACOSF   all six, instead of math.h; and
                               FABSF, if the machine has an instruction for it
         TERRIMP_MALLOC(bytes), TERRIMP_FREE(pointer)       instead of stdlib.h
         TERRIMP_NO_MALLOC     no create and destroy, no stdlib.h (also before the API)
         TERRIMP_NO_BUILD      no simplifier and no building: terrains are opened from bakes (also
                               before the API)
         TERRIMP_NO_SPLIT      views make no picture in two parts, as with no_splits
         TERRIMP_NO_MORPH      no morph_ratio above 1: E_RANGE
         TERRIMP_NO_TROUBLE    no functions that name a wrong field (also before the API)
         TERRIMP_FIXED         Sorted gives out heights as integers (also before the API)
       No double, and no 64-bit division once a terrain is built (make sizes checks it). With
       TERRIMP_NO_BUILD a host that opens a bake, updates and renders links 36 KB of code at -Os on
       a Cortex-M4, 34 KB without the two options that follow it above, if its linker drops
       unused functions: -ffunction-sections for the compiler, --gc-sections for the linker. Small
       state: 257 x 257 samples in chunks of 16 from a bake, 24 pictures and 64 ground nodes, take
       under 32 KiB in all. Stack, however large the terrain: a frame takes 2.5 KB besides what the
       callbacks take, building 6 KB.

   REFERENCES
       Hess     W. Hess, Terrain Impostors, Master's thesis, Cal Poly San Luis Obispo, 2010
       de Boer  W. H. de Boer, Fast Terrain Rendering Using Geometrical MipMapping, 2000
       Finch    M. Finch, L. Bishop, Sorted Height Field Rendering, Numerical Design, 1998
       Wagner   D. Wagner, Terrain Geomorphing in the Vertex Shader, in ShaderX2, 2003
       FFDH     E. G. Coffman, M. R. Garey, D. S. Johnson, R. E. Tarjan, Performance Bounds for
                Level-Oriented Two-Dimensional Packing Algorithms, SIAM J. Comput. 9, 1980
       Jeschke  S. Jeschke, Accelerating the Rendering Process Using Impostors, dissertation, TU
                Wien, 2004: layers */

/* ==== Configuration ====================================================== >>config */

#ifndef TERRIMP_H
#define TERRIMP_H

#include <stddef.h>
#include <stdint.h>

#define TERRIMP_VERSION_MAJOR 0
#define TERRIMP_VERSION_MINOR 5
#define TERRIMP_VERSION_PATCH 0
#define TERRIMP_VERSION "0.5.0"

/* Linkage of every public function. TERRIMP_STATIC makes them private to one file, where those
   that are not called are no fault. */
#ifndef TERRIMP_API
#if defined(TERRIMP_STATIC) && defined(__GNUC__)
#define TERRIMP_API static __attribute__((unused))
#elif defined(TERRIMP_STATIC)
#define TERRIMP_API static
#else
#define TERRIMP_API extern
#endif
#endif

/* Largest number of samples along one side of a heightfield. */
#define TERRIMP_MAX_DIM 65537u

#ifdef __cplusplus
extern "C" {
#endif

/* ==== Basics ============================================================= >>basics */

/* Every result code: name, value, text. The text says what to do about it. */
#define TERRIMP_RESULTS(X)                                                                        \
    X(TERRIMP_OK, 0, "ok")                                                                        \
    X(TERRIMP_E_NULL, 1, "a required pointer is null")                                            \
    X(TERRIMP_E_RANGE, 2, "a value is outside its limits: see the comment of the field")          \
    X(TERRIMP_E_NOT_FINITE, 3, "a number is NaN or infinite")                                     \
    X(TERRIMP_E_OVERFLOW, 4, "the sizes multiply to more than size_t holds: use smaller ones")    \
    X(TERRIMP_E_MEMORY, 5, "the block of memory is too small: ask the size function")             \
    X(TERRIMP_E_ALIGN, 6, "a pointer is not aligned for its type")                                \
    X(TERRIMP_E_VOID, 7, "the heightfield has no-data samples: fill them first")                  \
    X(TERRIMP_E_CAPACITY, 8, "an output array is too small")                                      \
    X(TERRIMP_E_INSIDE, 9, "the eye is inside the box: draw it as ground")                        \
    X(TERRIMP_E_BEHIND, 10, "the box crosses the plane of the eye: draw it as ground")            \
    X(TERRIMP_E_STATE, 11, "called too early: build or update first")                             \
    X(TERRIMP_E_MISS, 12, "the ray or the point does not meet the terrain")                       \
    X(TERRIMP_E_BAKE, 13, "the block is damaged, or no bake of this version and heightfield")     \
    X(TERRIMP_E_ORDER, 14, "the bake has the other byte order: write it swapped")                 \
    X(TERRIMP_E_PAGE, 15, "a page of the terrain that this needs is not here: fetch it first")

typedef enum terrimp_result {
#define TERRIMPI_X(name, value, text) name = value,
    TERRIMP_RESULTS(TERRIMPI_X)
#undef TERRIMPI_X
    TERRIMP_RESULT_COUNT
} terrimp_result;

/* The text of a result code; "unknown result" for any other number. */
TERRIMP_API const char *terrimp_result_text(int result);

/* An axis-aligned box, [wu]. */
typedef struct terrimp_box {
    float min[3];
    float max[3];
} terrimp_box;

/* Sides of a node or of a tile of samples. Z0 and Z1 run along x; of either pair the odd one is the
   last row or column. */
enum {
    TERRIMP_SIDE_Z0 = 0, /* towards -z */
    TERRIMP_SIDE_Z1,
    TERRIMP_SIDE_X0,     /* towards -x */
    TERRIMP_SIDE_X1,
    TERRIMP_SIDE_COUNT
};

/* ==== Heightfield ======================================================== >>heightfield */

/* Storage of one sample. */
typedef enum terrimp_format {
    TERRIMP_FORMAT_DEFAULT = 0, /* same as F32 */
    TERRIMP_FORMAT_U8,
    TERRIMP_FORMAT_U16,
    TERRIMP_FORMAT_S16,
    TERRIMP_FORMAT_F32,
    TERRIMP_FORMAT_COUNT
} terrimp_format;

/* A view of the caller's samples; nothing is copied. Sample (column x, row z) lies at world
   (origin_x + x * spacing_x, height_offset + height_scale * sample, origin_z + z * spacing_z). */
typedef struct terrimp_heightfield {
    const void *samples;    /* (required) sample (0, 0); aligned for its type, native byte order */
    uint32_t width;         /* (required) samples along x [Limits: 2..TERRIMP_MAX_DIM] */
    uint32_t depth;         /* (required) samples along z [Limits: 2..TERRIMP_MAX_DIM] */
    int format;             /* terrimp_format [Default 0 -> F32] */
    size_t row_bytes;       /* from a row to the next, a multiple of the sample's size
                               [Default 0 -> width * sample size] */
    float spacing_x;        /* [wu] between columns [Limits: > 0] [Default 0 -> 1] */
    float spacing_z;        /* [wu] between rows [Limits: > 0] [Default 0 -> 1] */
    float height_scale;     /* [wu] for one step of a sample [Limits: > 0] [Default 0 -> 1] */
    float height_offset;    /* [wu] height of sample value 0 */
    float origin_x;         /* [wu] x of column 0 */
    float origin_z;         /* [wu] z of row 0 */
    float no_data;          /* the sample value that means no data, when has_no_data */
    int has_no_data;        /* nonzero: samples equal to no_data are voids; F32 NaN is one too */
    int wrap;               /* nonzero: the field repeats without end, its last column and row being
                               the first ones of the next. Heights, normals, rays, Sorted and views
                               know of it; a terrain is one repetition */
} terrimp_heightfield;

/* Every function below takes the descriptor as it was filled in, or as resolve wrote it. The
   surface of the queries is the full-resolution one: columns and rows rounded to float, each quad
   the two triangles of CONVENTIONS. A quad with a void at one of its four corners is a hole. */

/* Checks a descriptor and fills in its defaults.

   in         what the caller filled in
   out        receives the effective descriptor; may be in itself
   Errors     E_RANGE also when row_bytes is shorter than a row or no multiple of a sample; when the
              spacing is so fine, or the origin so distant, that a float cannot tell neighbouring
              columns apart; when a sample of the integer formats would get an infinite height
   Cost       O(1); the samples are not read */
TERRIMP_API terrimp_result terrimp_heightfield_resolve(const terrimp_heightfield *in,
                                                       terrimp_heightfield *out);

/* Looks for the first sample, row by row, that is no height.

   x, z       receive its column and row on E_VOID, and on E_NOT_FINITE if a sample is the cause;
              NULL: not wanted
   Errors     E_VOID, E_NOT_FINITE for such a sample
   Cost       O(width * depth) */
TERRIMP_API terrimp_result terrimp_heightfield_validate(const terrimp_heightfield *field,
                                                        uint32_t *x, uint32_t *z);

/* Reads a tile of world heights. A tile may reach over the last column and row: it repeats them.

   x, z       column and row of the tile's first sample [Limits: inside the field]
   cols, rows size of the tile in samples [Limits: >= 1]
   stride     steps of the field from one sample of the tile to the next [Limits: >= 1]
   out        [rows][cols] [wu] receives the heights; must not overlap the samples
   Errors     E_VOID, E_NOT_FINITE for such a sample in the tile
   Cost       O(cols * rows), read twice: out is written only once the tile is known to be good */
TERRIMP_API terrimp_result terrimp_heightfield_read(const terrimp_heightfield *field, uint32_t x,
                                                    uint32_t z, uint32_t cols, uint32_t rows,
                                                    uint32_t stride, float *out);

/* The exact lowest and highest world height within a rectangle of samples. Voids do not count.

   x, z       column and row of the first sample [Limits: inside the field]
   cols, rows size in samples [Limits: >= 1]; what reaches over the last column and row is cut
   low, high  [wu] receive the heights
   Errors     E_VOID when every sample is a void; E_NOT_FINITE for such a height
   Cost       O(cols * rows) */
TERRIMP_API terrimp_result terrimp_heightfield_bounds(const terrimp_heightfield *field, uint32_t x,
                                                      uint32_t z, uint32_t cols, uint32_t rows,
                                                      float *low, float *high);

/* The world height of the surface at a world position.

   x, z       [wu] position; the outline of the field belongs to it
   height     [wu] receives the height
   Errors     E_MISS outside of the field; E_VOID in a hole; E_NOT_FINITE also for heights
   Cost       O(1) */
TERRIMP_API terrimp_result terrimp_heightfield_height(const terrimp_heightfield *field, float x,
                                                      float z, float *height);

/* The normal of the triangle at a world position: unit length, y > 0. On an edge between triangles
   it is that of the triangle towards +z, else towards +x, while there is one.

   x, z       [wu] position
   normal     [3] receives the normal
   Errors     as terrimp_heightfield_height
   Cost       O(1) */
TERRIMP_API terrimp_result terrimp_heightfield_normal(const terrimp_heightfield *field, float x,
                                                      float z, float normal[3]);

typedef struct terrimp_ray_hit {
    float distance;    /* [wu] from the ray's origin */
    float position[3]; /* [wu] on the surface */
    float normal[3];   /* of the triangle, y > 0 also for a ray that comes from below */
    uint32_t x, z;     /* the quad: column and row of its first corner */
} terrimp_ray_hit;

/* The first meeting of a ray and the surface. The surface has two sides: a ray that starts below it
   meets its underside. It has no thickness, no walls round the field, and holes let a ray through.

   origin        [3] [wu] start of the ray, anywhere
   direction     [3] any length but zero
   max_distance  [wu] end of the ray [Limits: > 0; FLT_MAX for no end. In a field that wraps, where
                 a level ray would go on for ever, up to 2^20 spacings]
   hit           receives the meeting; NULL: not wanted
   Errors        E_MISS when the ray meets nothing
   Cost          O(number of quads below the ray), at most width + depth
   Source        Amanatides and Woo 1987, A fast voxel traversal algorithm: the walk */
TERRIMP_API terrimp_result terrimp_heightfield_raycast(const terrimp_heightfield *field,
                                                       const float origin[3],
                                                       const float direction[3],
                                                       float max_distance, terrimp_ray_hit *hit);

/* ==== Camera ============================================================= >>camera */

/* The eye of a frame; or the direction from which a shadow map, or a map, shows the terrain. */
typedef struct terrimp_camera {
    float eye[3];           /* [wu] [Limits: -1e18..1e18] */
    float forward[3];       /* (required) viewing direction, any length > 0 */
    float up[3];            /* [Default 0,0,0 -> 0,1,0]; along forward: another one is chosen */
    float fov_y_rad;        /* vertical field of view [Limits: 0.001..3.1] [Default 0 -> pi / 3] */
    uint32_t width_px;      /* (required) viewport [Limits: 1..65536] */
    uint32_t height_px;     /* (required) viewport [Limits: 1..65536] */
    float z_near;           /* (required) [wu] clip distance along forward
                               [Limits: > 0; orthographic: any] */
    float z_far;            /* [wu] clip distance along forward [Limits: > z_near]
                               [Default 0, or more than 1e18 -> an infinite far plane;
                               orthographic: required] */
    int depth_zero_to_one;  /* nonzero: clip depth 0..1 (Direct3D, Vulkan), else -1..1 (OpenGL) */
    int rows_from_top;      /* nonzero: clip y = +1 is row 0 of a render target (Direct3D, Metal,
                               WebGPU), else its last row (OpenGL, Vulkan). Matrices are alike; the
                               texture matrices of pictures look where these were drawn */
    int orthographic;       /* nonzero: all rays run along forward, and sides are required */
    float sides[4];         /* where the viewport ends to the left, right, below, above: tangents
                               from forward, or [wu] from the eye when it is orthographic.
                               Off-centre for the eyes of a headset, tiles of a large picture,
                               jitter [Limits: rising, -1e4..1e4; orthographic: -1e18..1e18]
                               [Default all 0 -> by fov_y_rad, symmetric, pixels square] */
    float reach;            /* [wu] what is decided holds for all eyes so close to this one: half
                               the distance of two that share an update [Limits: 0..1e18] */
} terrimp_camera;

#ifndef TERRIMP_NO_TROUBLE
/* The name of a field that makes resolve refuse a descriptor, for whoever looks for a mistake; NULL
   when there is none. Of several wrong ones it names one. */
TERRIMP_API const char *terrimp_heightfield_trouble(const terrimp_heightfield *field);
TERRIMP_API const char *terrimp_camera_trouble(const terrimp_camera *camera);
#endif

/* Writes the effective camera: defaults filled in, forward and up orthonormal; out may be
   camera. */
TERRIMP_API terrimp_result terrimp_camera_resolve(const terrimp_camera *camera,
                                                  terrimp_camera *out);

/* View and projection matrix, for column vectors, column-major.

   view          [16] out, world to eye space (x right, y up, looking along -z)
   projection    [16] out, eye space to clip space */
TERRIMP_API terrimp_result terrimp_camera_matrices(const terrimp_camera *camera, float view[16],
                                                   float projection[16]);

/* K, the pixels that one unit of size covers at distance 1 in the middle of the screen:
   height_px / (2 tan(fov_y / 2)). An angle of a radians there is about K * a pixels. Orthographic:
   at any distance. Where pixels are not square, the larger of two.
   Source: de Boer 2000, 1a to 1c: K = C * tolerance. */
TERRIMP_API terrimp_result terrimp_camera_pixel_factor(const terrimp_camera *camera, float *factor);

/* The six planes of a viewing volume. A point p is inside plane i when
   dot(plane[i].xyz, p - eye) + plane[i].w >= 0: relative to the eye, so that huge worlds keep
   precision. */
typedef struct terrimp_frustum {
    float eye[3];
    float plane[6][4]; /* left, right, down, up, near, far; normals need not be unit */
} terrimp_frustum;

enum {
    TERRIMP_PLANES_ALL = 0x3f, /* start with this mask at the root of a hierarchy */
    TERRIMP_PLANES_OUTSIDE = -1
};

/* The planes of a camera, moved out by its reach. */
TERRIMP_API terrimp_result terrimp_camera_frustum(const terrimp_camera *camera,
                                                  terrimp_frustum *frustum);

/* Tests a box against the planes of a mask (bit i: plane i), for use down a hierarchy: a child of a
   box inside a plane need not be tested against it again.

   frustum, box   not null
   returns    TERRIMP_PLANES_OUTSIDE when the box is outside of one of the planes, else the mask of
              the planes that still cross it; 0: wholly inside. A box near an edge of the frustum
              may be reported as crossing though it is outside: never the other way round.
   Source     de Boer 2000, section 2.2 */
TERRIMP_API int terrimp_frustum_test(const terrimp_frustum *frustum, const terrimp_box *box,
                                     int mask);

/* Distances from a point to the closest (0 inside) and to the farthest point of a box [wu]. No
   pointer may be null. */
TERRIMP_API float terrimp_box_distance(const terrimp_box *box, const float point[3]);
TERRIMP_API float terrimp_box_farthest(const terrimp_box *box, const float point[3]);

/* A frustum fitted to a box: the camera of a capture. Its sides are tangents, that is offsets along
   right and up at distance 1 along forward; left and down are the smaller ones. Of an orthographic
   one they are [wu], and z_near may be below 0. */
typedef struct terrimp_capture {
    float eye[3];
    float right[3], up[3], forward[3]; /* orthonormal */
    float z_near, z_far;               /* [wu] along forward */
    float tan_left, tan_right, tan_down, tan_up;
    int orthographic;
} terrimp_capture;

/* Fits a frustum with its apex at the eye and its axis through the middle of the box around the
   box's eight corners, as tightly as the axis allows.

   box        any extents >= 0, flat ones too
   Errors     E_RANGE when a minimum exceeds its maximum, or for 1e18 and more; E_INSIDE when the
              eye is in the box; E_BEHIND when a corner is not in front of the eye
   Source     Hess 2010, section 3.2. Straight above or below a box, where his up vector (the y
              axis) is useless, -z is up. */
TERRIMP_API terrimp_result terrimp_capture_fit(const terrimp_box *box, const float eye[3],
                                               terrimp_capture *capture);

/* Matrices of a capture, as terrimp_camera_matrices gives those of a camera. */
TERRIMP_API terrimp_result terrimp_capture_matrices(const terrimp_capture *capture,
                                                    int depth_zero_to_one, float view[16],
                                                    float projection[16]);

/* ==== Quadtree =========================================================== >>quadtree */

#define TERRIMP_QUADTREE_LEVELS 17u /* 65537 samples in chunks of 4 quads have 15 */

/* A node and where it lies: its column and row among the nodes of its level. */
typedef struct terrimp_node {
    uint32_t number, level, x, z;
} terrimp_node;

/* The nodes over a heightfield. A node of level L covers (chunk_quads << L)^2 quads of the field,
   fewer at the far edges. Nodes are numbered level by level from the finest up, each level row by
   row; the last one is the root. Read-only once built, for any number of views and threads. */
typedef struct terrimp_quadtree {
    terrimp_heightfield field; /* resolved; its samples outlive the tree */
    uint32_t chunk_quads;
    uint32_t level_count, node_count;
    uint32_t level_first[TERRIMP_QUADTREE_LEVELS + 1u]; /* number of a level's first node */
    uint32_t level_x[TERRIMP_QUADTREE_LEVELS], level_z[TERRIMP_QUADTREE_LEVELS]; /* its nodes */
    struct terrimp_geomip_node *nodes; /* (required before build) [node_count] the caller's */
    struct terrimp_pages *pages; /* of a terrain in pages, which has no nodes: else NULL */
    uint32_t edits;            /* to be counted up when nodes have been built anew: views notice */
} terrimp_quadtree;

/* Lays the quadtree out; nodes is left NULL for the caller to set.

   chunk_quads  [Limits: even, 4..128] [Default 0 -> 64] 32 asks for twice as many draws, of a third
                fewer triangles, for the same picture */
TERRIMP_API terrimp_result terrimp_quadtree_init(const terrimp_heightfield *field,
                                                 uint32_t chunk_quads, terrimp_quadtree *tree);

/* The node of a level over a world position; on a border between two, the one towards +x, +z.

   level    [Limits: < level_count]
   x, z     [wu]
   Errors   E_MISS beside the field */
TERRIMP_API terrimp_result terrimp_quadtree_find(const terrimp_quadtree *tree, uint32_t level,
                                                 float x, float z, terrimp_node *node);

/* ==== Geomipmap ========================================================== >>geomipmap */

/* Geometrical mipmapping alone. A node is always drawn as chunk_quads x chunk_quads quads of every
   2^level-th sample; vertices beyond the last column or row stand on it. So one shared index buffer
   serves every node.

   How to use it: terrimp_quadtree_init and build once, then select each frame: it lists the nodes
   to draw. */

/* --- patterns: the shared index buffer --- */

/* Bit i of a pattern says that the neighbour at side i is one level coarser: there the node leaves
   out its odd border vertices, which the neighbour lacks. */
#define TERRIMP_PATTERN_COUNT 16u

typedef enum terrimp_form { /* of the index buffer */
    TERRIMP_FORM_LIST = 0, /* triangle lists */
    TERRIMP_FORM_STRIP,    /* each pattern is one triangle strip */
    TERRIMP_FORM_COUNT
} terrimp_form;

typedef struct terrimp_pattern {
    uint32_t first_index, index_count; /* in the index buffer */
    uint32_t triangle_count; /* without those of no area */
} terrimp_pattern;

/* The place of a pattern.

   chunk_quads  quads along a node's side [Limits: even, 4..128]
   form         terrimp_form
   pattern      [Limits: < TERRIMP_PATTERN_COUNT] */
TERRIMP_API terrimp_result terrimp_pattern_find(uint32_t chunk_quads, int form, uint32_t pattern,
                                                terrimp_pattern *found);

/* Indices of all patterns together; 0 when an argument is outside its limits. */
TERRIMP_API uint32_t terrimp_pattern_index_count(uint32_t chunk_quads, int form);

/* Fills the shared index buffer, once: it never changes. Counter-clockwise seen from above, in an
   order for vertex caches that hold 16 vertices and more: columns of up to 14 quads, the first row
   of each fetched ahead by triangles of no area. With a cache of 16 entries (FIFO) 0.60 vertices
   are transformed for each triangle at chunk_quads 16, 0.55 at 64.

   indices     [terrimp_pattern_index_count] out
   Source      de Boer 2000, section 2.3.2 (borders); Wagner 2003 (strips with degenerate joins) */
TERRIMP_API terrimp_result terrimp_pattern_fill(uint32_t chunk_quads, int form, uint16_t *indices,
                                                size_t capacity);

/* --- errors --- */

/* What is kept of a node. */
typedef struct terrimp_geomip_node {
    float low, high; /* [wu] of its samples, and of all that it can be drawn as */
    float error;     /* [wu] largest vertical distance of a sample to the drawn triangles: those of
                        the node in pattern 0, and those that a finer neighbour draws up to it; at
                        least that of its children. 0 at level 0 */
    float rms;       /* [wu] root of the mean square of that distance, for pattern 0 */
} terrimp_geomip_node;

/* The box of a node. */
TERRIMP_API terrimp_result terrimp_geomip_box(const terrimp_quadtree *tree, uint32_t node,
                                              terrimp_box *box);

/* --- selection --- */

/* What a node has to fulfil to be drawn as it is. */
typedef enum terrimp_geomip_rule {
    TERRIMP_GEOMIP_DEFAULT = 0, /* same as PICTURE */
    TERRIMP_GEOMIP_PICTURE,  /* rms error and size on the screen together are small: triangles go
                                where the picture gains most; no promise for a single sample */
    TERRIMP_GEOMIP_BOUND,    /* no sample in view is drawn more than tolerance_px from its place */
    TERRIMP_GEOMIP_DISTANCE, /* the same promise by distance alone, at the steepest angle */
    TERRIMP_GEOMIP_RULE_COUNT
} terrimp_geomip_rule;

/* What a view needs for BOUND, in its settings: a linker leaves it out where none does. */
typedef struct terrimp_bound terrimp_bound;
TERRIMP_API const terrimp_bound *terrimp_geomip_bound(void);

typedef struct terrimp_geomip_draw {
    terrimp_node node;
    uint32_t pattern;
    float error_px;      /* by the rule, <= tolerance_px; 0 at level 0 */
    float morph;         /* 0: as it is .. 1: the shape of its parent; 0 without morphing */
    float side[TERRIMP_SIDE_COUNT];        /* the same for odd vertices of each border */
    float side_coarse[TERRIMP_SIDE_COUNT]; /* of a coarser neighbour: for even border vertices; 0
                                              where the neighbour is not coarser */
} terrimp_geomip_draw;

/* Working memory of one node in one view. */
typedef struct terrimp_geomip_mark {
    float measure;  /* square of error over tolerance: from 1 on the node is split; below 0: it
                       would be, but pages are missing */
    uint32_t next;  /* in the list of its level */
    uint32_t frame; /* when it was written */
} terrimp_geomip_mark;

/* One camera's settings and arrays. Zero it, set what is required; select does the rest. */
typedef struct terrimp_geomip_view {
    int rule;           /* terrimp_geomip_rule */
    float tolerance_px; /* [Limits: 0.01..1000] [Default 0 -> 1] */
    float morph_ratio;  /* above 1: nodes morph; fully split at a distance that many times smaller
                           than where the split begins [Limits: 1..4] [Default 0 -> 1: they do
                           not morph] */
    float hysteresis;   /* without morphing: a split node stays split until its error is below
                           tolerance / (1 + hysteresis) [Limits: 0..1] */
    float *distances;             /* (required) [node_count] squares of those at which nodes stop
                                     being drawn as they are, 1e30 at most; de Boer's D_n^2 for the
                                     level above. Remade when what they depend on has changed */
    terrimp_geomip_mark *marks;   /* (required) [node_count] zero before the first frame */
    terrimp_geomip_draw *draws;   /* (required) [draw_capacity] out: front to back */
    uint32_t draw_capacity;
    uint32_t draw_count;          /* out */
    uint32_t triangle_count;      /* out: of these draws */
    uint32_t draws_needed;        /* out: draw_count, or more when draw_capacity is too small */
    float distances_for[5];       /* private: what distances was made for */
    uint32_t frame;               /* private */
} terrimp_geomip_view;

/* Selects the nodes of a frame: they tile the terrain without overlap, sides differ by at most one
   level, those outside of the camera's view are left out.

   view       in: settings and arrays; out: draws, draw_count, triangle_count
   Errors     E_CAPACITY: draw_count is 0, draws_needed says how many there are. After others the
              draws of the frame before stay
   Cost       O(nodes split + nodes drawn); 0.02 to 0.1 ms for 4097 x 4097 samples in chunks of 64
   Source     de Boer 2000, sections 2.2 and 2.3.1, equations 1 to 2 */
TERRIMP_API terrimp_result terrimp_geomip_select(const terrimp_quadtree *tree,
                                                 terrimp_geomip_view *view,
                                                 const terrimp_camera *camera);

/* --- vertices and morphing --- */

/* A node's vertex: what it moves by when its factors are 1. */
typedef struct terrimp_geomip_vertex {
    float height;    /* [wu] */
    float move;      /* [wu] to the parent's shape; for even vertices on a border, from there to the
                        shape of the parent's parent */
    float beside[2]; /* [wu] what is added to move where the border vertices that an odd vertex
                        stands between move themselves: those of a border along x, along z */
} terrimp_geomip_vertex;

/* Which factors of a draw a vertex of the grid follows: each 0 or 1, the same for every node.

   y = height + (self * morph + dot(odd, side) + dot(even, side_coarse))
              * (move + beside[0] * (weight beside[Z0] * side_coarse[Z0] + the same of Z1)
                      + beside[1] * (weight beside[X0] * side_coarse[X0] + the same of X1)) */
typedef struct terrimp_geomip_weights {
    uint8_t odd[TERRIMP_SIDE_COUNT], even[TERRIMP_SIDE_COUNT];
    uint8_t beside[TERRIMP_SIDE_COUNT];
    uint8_t self, unused[3];
} terrimp_geomip_weights;

/* Fills the vertices of a node of any level, row by row.

   xyz        [(chunk_quads + 1)^2][3] out: unmorphed positions [wu]; NULL: not wanted
   vertices   [(chunk_quads + 1)^2] out; NULL: not wanted */
TERRIMP_API terrimp_result terrimp_geomip_fill_vertices(const terrimp_quadtree *tree, uint32_t node,
                                                        float *xyz,
                                                        terrimp_geomip_vertex *vertices);

/* Fills the weights of a node's vertices, for all nodes the same.

   weights    [(chunk_quads + 1)^2] out */
TERRIMP_API terrimp_result terrimp_geomip_fill_weights(uint32_t chunk_quads,
                                                       terrimp_geomip_weights *weights);

/* Morphs a node's vertices on the CPU, for hosts without shaders. Vertices that neighbours share
   come out equal, bit for bit.

   draw       from select
   vertices   [(chunk_quads + 1)^2] of that node
   heights    out: the height of vertex k at heights[k * stride] [wu]
   stride     [Limits: >= 1] 3 to write into xyz + 1
   Source     de Boer 2000, equations 3 and 4; Wagner 2003: five tweening factors, and
              tweeningA = (1 - tweeningL) * tweeningI beside a border. Here factors run the other
              way, 1 being the coarse shape, so that this product reads side_coarse * morph. */
TERRIMP_API terrimp_result terrimp_geomip_morph(uint32_t chunk_quads,
                                                const terrimp_geomip_draw *draw,
                                                const terrimp_geomip_vertex *vertices,
                                                float *heights, size_t stride);

/* ==== Impostor =========================================================== >>impostor */

/* A rectangle of texels; (x, y) is its corner with the smallest coordinates. */
typedef struct terrimp_rect {
    uint32_t x, y, width, height;
} terrimp_rect;

/* Size of a picture that gives a number of texels to each pixel the box covers on the screen.

   pixel_factor     K of the screen's camera
   texels_per_px    [Limits: > 0] 1: as sharp as the screen before resampling; 2 hides resampling
   smallest         lower limit of both sides [texels]
   largest          upper limit of both sides [texels] [Limits: >= smallest, >= 1]
   size             [2] out, width and height; rounded up
   scale            out, 1, or the factor by which the picture was reduced to keep to `largest`;
                    may be NULL
   Source           Hess 2010, equations 3.3 and 3.4 */
TERRIMP_API terrimp_result terrimp_impostor_size(const terrimp_capture *capture, float pixel_factor,
                                                 float texels_per_px, uint32_t smallest,
                                                 uint32_t largest, uint32_t size[2], float *scale);

/* Widens a capture so that a margin of texels surrounds the picture that was fitted: bilinear reads
   at its rim then stay inside the slot.

   capture    in and out
   slot       [2] width and height of the whole slot, margins included [Limits: > 2 * margin] */
TERRIMP_API terrimp_result terrimp_capture_pad(terrimp_capture *capture, const uint32_t slot[2],
                                               uint32_t margin);

/* The matrix that takes (x, y, z, 1), a position relative to the capture's eye, to (s, t, r, q):
   the picture lies in the atlas at (s / q, t / q), in 0..1 over the whole atlas; r / q is the depth
   in 0..1. Relative to the eye, so that pictures stay in place however distant the origin is.

   capture         if clip y = +1 is row 0 of the atlas: with tan_up and tan_down exchanged
   slot            the capture's rectangle in the atlas, margins included
   atlas_width     [texels]
   matrix          [16] out, column-major
   Errors          E_RANGE when the slot is empty or leaves the atlas
   Source          Hess 2010, section 3.4, made projective: interpolating s and t themselves would
                   bend the picture inside large triangles */
TERRIMP_API terrimp_result terrimp_texture_matrix(const terrimp_capture *capture,
                                                  const terrimp_rect *slot, uint32_t atlas_width,
                                                  uint32_t atlas_height, float matrix[16]);

/* The way back: the matrix that takes (s / q, t / q, r / q, 1), the last of the three the depth of
   a capture's picture, to the place that is seen there, relative to an eye, times a factor. capture
   and slot as for the texture matrix.

   eye             [3] [wu] of the frame: results are exact close to it, wherever the origin is
   matrix          [16] out, column-major
   Errors          E_RANGE when the slot is empty or leaves the atlas
   Source          Hess 2010, section 6.3 */
TERRIMP_API terrimp_result terrimp_place_matrix(const terrimp_capture *capture,
                                                const terrimp_rect *slot, uint32_t atlas_width,
                                                uint32_t atlas_height, const float eye[3],
                                                float matrix[16]);

/* Applies a texture matrix on the CPU, for hosts without shaders or texture matrices: from
   xyz [count][3], world positions, and the capture's eye, to stq [count][3], which may not overlap
   xyz. */
TERRIMP_API terrimp_result terrimp_texture_coordinates(const float matrix[16], const float eye[3],
                                                       const float *xyz, size_t count, float *stq);

/* A normal of ground in two bytes, for pictures that are lit when they are drawn: they keep colours
   without light, and these in a second plane of the same slots. A shader has the normal back as
   terrimp_normal_decode does, from e = 2 code / 255 - 1: p = (e.x + e.y, e.x - e.y) / 2, and
   (p.x, 1 - |p.x| - |p.y|, p.y) of unit length. Bytes may be filtered as they are.

   normal     [3] any length > 0 [Limits: y >= 0]
   code       out: off by 0.55 degrees at most, 2.5 of 255 grey levels of matt ground
   Source     Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors,
              2014: the octahedron of a hemisphere */
TERRIMP_API terrimp_result terrimp_normal_encode(const float normal[3], uint8_t code[2]);
TERRIMP_API void terrimp_normal_decode(const uint8_t code[2], float normal[3]);

/* The largest angle, over the box's eight corners, between the directions to two eyes.

   angle_rad    out, 0..pi
   Source       Hess 2010, section 3.5: all corners, since an eye can approach the centre of a large
                impostor without turning around it */
TERRIMP_API terrimp_result terrimp_view_angle(const terrimp_box *box, const float captured_eye[3],
                                              const float eye[3], float *angle_rad);

/* Bound of the parallax error: how far from its place, in pixels at the middle of the screen, a
   terrain point can appear that lies up to `error` off the mesh its picture is projected on, when
   the eye has moved since the capture.

   box            holds the terrain and the mesh
   error          [wu] largest distance, along a ray of the capture, from terrain to mesh. Views
                  pass the vertical one: with meshes that stand proud the bound then held for every
                  sample that a capture saw, but at grazing angles (measured: up to 1.1 times it)
   error_px       out; +infinity when the eye is within `error` of the box and has moved
   Errors         E_RANGE when error < 0 or pixel_factor <= 0
   Source         own derivation, in the implementation; DESIGN: err * sin(theta) * K / d, with the
                  sine bounded over the whole box, not sampled at its corners */
TERRIMP_API terrimp_result terrimp_parallax_error(const terrimp_box *box, float error,
                                                  const float captured_eye[3], const float eye[3],
                                                  float pixel_factor, float *error_px);

/* Shortest time for which a picture stays within a view angle.

   distance         [wu] from the captured eye to the closest point of the box [Limits: >= 0]
   max_angle_rad    [Limits: 0..pi]; from pi/2 on the angle needs a path of `distance`
   speed            [wu/s] of the eye [Limits: > 0]
   seconds          out
   Source           Hess 2010, equation 3.6: t = D sin(alpha) / S */
TERRIMP_API terrimp_result terrimp_impostor_lifetime(float distance, float max_angle_rad,
                                                     float speed, float *seconds);

/* What a mesh hides from a capture and an eye that moves comes to see, and where the picture would
   best be split in two. */
typedef struct terrimp_split {
    float distance; /* [wu] along forward; 0 when nothing comes into sight */
    float gap;      /* root mean square, over the mesh as those eyes see it, of the part of its
                       distance by which it lies behind what hid it: it wears the picture of that,
                       and once the eye has turned by an angle a it is about K sin(a) gap pixels
                       off */
    float gap_left; /* the same for pictures split there */
} terrimp_split;

/* Finds the best place to split a picture: the front part shows what lies before it, the back part
   what lies behind it, with the same frustum. A slope behind a ridge then has a picture of its own.

   xyz, vertex_count       [vertex_count][3] a mesh in front of the eye [wu]
   indices, index_count    its triangles
   reach      [wu] how far the eye moves before the picture is renewed: up, left and right are tried
              [Limits: > 0]
   overlap    [wu] by which each part goes beyond the place of the split, since the mesh is not the
              terrain; what hides and what is hidden must both be that far from it [Limits: >= 0]
   Errors     E_RANGE, also for an index beyond the vertices, a count not of triangles, and an
              orthographic capture
   Cost       O(triangles): about 8 us for 85 triangles; 2 KB of stack
   Source     Hess 2010, section 6.2, which proposes the split and leaves its place open */
TERRIMP_API terrimp_result terrimp_capture_split(const terrimp_capture *capture, const float *xyz,
                                                 uint32_t vertex_count, const uint16_t *indices,
                                                 uint32_t index_count, float reach, float overlap,
                                                 terrimp_split *split);

/* ==== Atlas ============================================================== >>atlas */

/* First-fit decreasing height: rectangles stand side by side on shelves, from the tallest on, each
   on the lowest shelf with room for it. If they do not all fit, all are reduced alike, in steps of
   6 %, until they do. For texels between two of them, ask for larger ones.

   width, height  of the atlas [texels] [Limits: 1..65536]
   rects      [count] in: sizes, as large as they may be; one of width or height 0 is passed over;
              out: the sizes that fitted, and the places
   order      [2 * count] out: the first half is the order of insertion; the rest is scratch
   scale      out: what the sizes were multiplied by, 1 when they fitted; may be NULL
   Errors     E_RANGE; E_CAPACITY when not even one texel each fits: only places and order may
              have changed
   Cost       O(n^1.5 + n * shelves) for each step, no allocation
   Source     Coffman, Garey, Johnson, Tarjan 1980, as Hess 2010 uses it, section 4.3: the height
              used is at most 1.7 times the optimum plus one rectangle */
TERRIMP_API terrimp_result terrimp_pack_ffdh(uint32_t width, uint32_t height, terrimp_rect *rects,
                                             uint32_t count, uint32_t *order, float *scale);

/* An atlas whose slots are allocated and freed one by one, in any order, while the others stay
   where they are. */
typedef struct terrimp_live_atlas_desc {
    uint32_t width, height; /* (required) [texels] [Limits: 1..32768] */
    uint32_t padding;       /* texels kept free between two slots [Limits: 0..1024] */
    uint32_t max_slots;     /* (required) slots at a time [Limits: 1..65536] */
} terrimp_live_atlas_desc;

typedef struct terrimp_live_atlas {
    terrimp_live_atlas_desc desc;
    terrimp_rect *slots; /* [max_slots] where each lies; width 0: unused, x is the next unused */
    terrimp_rect *free_rects; /* [max_free] the maximal ones, which overlap each other */
    uint32_t free_count, max_free;
    uint32_t unused;     /* the first unused slot, max_slots for none */
    uint32_t slot_end;   /* above every slot that was ever used */
    uint32_t slot_count, texels_used; /* without padding */
    uint32_t failures;   /* allocations that found no room, since init */
} terrimp_live_atlas;

/* The size of the block of memory that an atlas needs beside its struct; 0 when init would refuse
   the descriptor, or for NULL. */
TERRIMP_API size_t terrimp_live_atlas_bytes(const terrimp_live_atlas_desc *desc);

/* An empty atlas; also empties one.

   memory     the caller's, aligned to 8 bytes, in use until the atlas is forgotten
   bytes      at least terrimp_live_atlas_bytes(desc)
   Cost       O(max_slots) */
TERRIMP_API terrimp_result terrimp_live_atlas_init(terrimp_live_atlas *atlas,
                                                   const terrimp_live_atlas_desc *desc,
                                                   void *memory, size_t bytes);

/* Finds room for a rectangle and keeps it.

   slot       out: its handle, < max_slots, until it is freed
   Errors     E_RANGE for an empty rectangle; E_CAPACITY when it fits nowhere or all slots are in
              use: counted as a failure, nothing else changes
   Cost       O(free rectangles), which are about twice as many as slots */
TERRIMP_API terrimp_result terrimp_live_atlas_alloc(terrimp_live_atlas *atlas, uint32_t width,
                                                    uint32_t height, uint32_t *slot);

/* Frees a slot: what borders on it grows together with it.
   Errors: E_STATE before init, and for a slot that is not in use; E_RANGE for no handle.
   Cost: O(slots + free rectangles). */
TERRIMP_API terrimp_result terrimp_live_atlas_free(terrimp_live_atlas *atlas, uint32_t slot);

/* ==== Terrain ============================================================ >>terrain */

typedef struct terrimp_terrain terrimp_terrain; /* built from a heightfield; read-only then */

#define TERRIMP_TRIANGLE_BUDGET 85u  /* of a coarse mesh if the desc says 0: 1 % of 64 x 64 quads */

/* Inner points that terrimp_border_simplify keeps when it is told 0. At 85 triangles over 64 x 64
   quads of real terrain 4, 5, 6 and 7 of them gave max errors of 13.7, 12.7, 12.8 and 12.8 %. */
#define TERRIMP_BORDER_POINTS 5u

/* What a terrain is built from. */
typedef struct terrimp_terrain_desc {
    terrimp_heightfield field; /* (required) without voids; its samples outlive the terrain */
    uint32_t chunk_quads;      /* quads along a chunk's side; chunks at the last column and row keep
                                  what is left [Limits: even, 4..128] [Default 0 -> 64] */
    uint32_t triangle_budget;  /* surface triangles of a coarse mesh at most
                                  [Limits: 32..400] [Default 0 -> 85] */
    float proud;               /* how far coarse meshes are raised over the terrain, as a fraction
                                  of what keeps every sample below them, so that silhouettes are
                                  not cut off [Limits: 0..1] [Default 0 -> 1, see not_proud] */
    int not_proud;             /* nonzero: meshes are not raised, whatever proud says */
    int no_lower_skirts;       /* nonzero: without skirts that hang from the border, by a quarter of
                                  the node's heights, down to neighbours of other levels */
    float height_low;          /* [wu] between these two all samples lie, also after edits: */
    float height_high;         /* meshes store those of borders in 2^22 steps of 3 times that range
                                  [Limits: height_low <= height_high]
                                  [Default both 0 -> terrimp_terrain_build_begin finds them] */
} terrimp_terrain_desc;

/* What a host needs to know to make its buffers. */
typedef struct terrimp_terrain_info {
    uint32_t chunk_quads;
    uint32_t chunks_x, chunks_z;    /* nodes of level 0: node `n` stands in column n % chunks_x, row
                                       n / chunks_x; each level above has half as many, rounded
                                       up */
    uint32_t level_count;           /* of the quadtree; level 0 is the chunks */
    uint32_t node_count;            /* of all levels */
    uint32_t ground_vertex_count;   /* of one node: (chunk_quads + 1)^2 */
    uint32_t ground_index_count;    /* of the shared buffer of all patterns */
    uint32_t mesh_vertex_stride;    /* from the vertices of a node's mesh to those of the next */
    uint32_t mesh_index_stride;     /* the same of its indices */
    uint32_t mesh_vertex_count;     /* node_count * mesh_vertex_stride, and the floor */
    uint32_t mesh_index_count;      /* node_count * mesh_index_stride, and the floor */
    uint32_t floor_vertex_count;    /* what is behind the meshes of all nodes: the floor, and the
                                       skirts of ground at the outer border */
    uint32_t floor_index_count;
    uint32_t mesh_triangle_count;   /* of all coarse meshes without skirts */
    terrimp_box box;                /* of everything that is drawn [wu] */
} terrimp_terrain_info;

/* Writes the effective descriptor, defaults filled in. out may be desc. */
TERRIMP_API terrimp_result terrimp_terrain_desc_resolve(const terrimp_terrain_desc *desc,
                                                        terrimp_terrain_desc *out);

#ifndef TERRIMP_NO_TROUBLE
/* As terrimp_heightfield_trouble; a wrong field of the heightfield is named by itself. */
TERRIMP_API const char *terrimp_terrain_desc_trouble(const terrimp_terrain_desc *desc);
#endif

/* Lists the nodes whose vertices have to be filled anew after some samples have changed: ground and
   coarse meshes; the floor, too, may have changed.

   samples    as in terrimp_terrain_rebuild
   morph      nonzero: also the nodes beside them whose morph data has changed
   nodes      [capacity] out, rising; NULL: only counted
   count      out: how many there are, also when they are more than capacity
   Errors     E_CAPACITY: nodes is untouched
   Cost       O(count) */
TERRIMP_API terrimp_result terrimp_terrain_touched(const terrimp_terrain *terrain,
                                                   const terrimp_rect *samples, int morph,
                                                   uint32_t *nodes, uint32_t capacity,
                                                   uint32_t *count);

/* Sizes and extents. Before terrimp_terrain_build_finish: E_STATE. */
TERRIMP_API terrimp_result terrimp_terrain_get_info(const terrimp_terrain *terrain,
                                                    terrimp_terrain_info *info);

/* The quadtree of a terrain, for what works on one. NULL when terrain is NULL or not built. */
TERRIMP_API const terrimp_quadtree *terrimp_terrain_tree(const terrimp_terrain *terrain);

/* The box of everything that is drawn of a node and of all nodes below it: samples, coarse meshes,
   skirts. */
TERRIMP_API terrimp_result terrimp_terrain_get_box(const terrimp_terrain *terrain, uint32_t node,
                                                   terrimp_box *box);

/* The place and the quality of a node's coarse mesh. */
typedef struct terrimp_mesh_info {
    uint32_t base_vertex, vertex_count; /* in the vertices of terrimp_terrain_fill_meshes */
    uint32_t first_index, index_count;  /* in its indices */
    uint32_t triangle_count;            /* of the surface */
    float error;                        /* [wu] largest vertical distance to a sample, as drawn */
    float error_rms;                    /* [wu] root mean square of it over all samples */
} terrimp_mesh_info;
TERRIMP_API terrimp_result terrimp_terrain_get_mesh(const terrimp_terrain *terrain, uint32_t node,
                                                    terrimp_mesh_info *mesh);

/* Fills the shared index buffer: all patterns that ground commands refer to, over the vertices of
   terrimp_terrain_fill_ground. Triangle list, counter-clockwise from above. First stand the
   patterns of terrimp_pattern_fill with TERRIMP_FORM_LIST, then the strips that captures draw.

   indices    [ground_index_count] out */
TERRIMP_API terrimp_result terrimp_terrain_fill_indices(const terrimp_terrain *terrain,
                                                        uint16_t *indices, size_t capacity);

/* Fills the ground vertices of a node, row by row: every 2^level-th sample. Beyond the last column
   or row of the heightfield the last sample is repeated, so that one pattern serves every node.

   node        of any level [Limits: < node_count]
   xyz         [ground_vertex_count][3] out
   capacity    floats */
TERRIMP_API terrimp_result terrimp_terrain_fill_ground(const terrimp_terrain *terrain,
                                                       uint32_t node, float *xyz, size_t capacity);

/* Fills what the ground vertices of a node move by when they morph. With which factor each moves
   say the weights that terrimp_geomip_fill_weights gives for chunk_quads and TERRIMP_FORM_LIST.

   vertices   [ground_vertex_count] out
   capacity   of vertices */
TERRIMP_API terrimp_result terrimp_terrain_fill_morph(const terrimp_terrain *terrain,
                                                      uint32_t node,
                                                      terrimp_geomip_vertex *vertices,
                                                      size_t capacity);

/* Fills the vertices and indices of one node's coarse mesh with its skirts, to stand at node *
   stride in the host's buffers. Indices count from its base vertex; what is over is 0.

   node        [Limits: <= node_count] node_count: the floor, behind all others
   xyz         [mesh_vertex_stride][3] out; for the floor what is left of mesh_vertex_count
   indices     [mesh_index_stride] out; the same
   capacities  floats, indices */
TERRIMP_API terrimp_result terrimp_terrain_fill_mesh(const terrimp_terrain *terrain, uint32_t node,
                                                     float *xyz, size_t xyz_capacity,
                                                     uint16_t *indices, size_t index_capacity);

/* Fills the vertices and indices of all coarse meshes with their skirts, and of the floor. Indices
   count from the base vertex of each mesh.

   xyz         [mesh_vertex_count][3] out
   indices     [mesh_index_count] out */
TERRIMP_API terrimp_result terrimp_terrain_fill_meshes(const terrimp_terrain *terrain, float *xyz,
                                                       size_t xyz_capacity, uint16_t *indices,
                                                       size_t index_capacity);

#ifndef TERRIMP_NO_MALLOC

/* Where create functions get memory. */
typedef struct terrimp_allocator {
    void *user;
    void *(*allocate)(void *user, size_t bytes);               /* NULL when there is none */
    void (*release)(void *user, void *pointer, size_t bytes);
} terrimp_allocator;

TERRIMP_API void terrimp_terrain_destroy(terrimp_terrain *terrain);

#endif /* TERRIMP_NO_MALLOC */

/* ==== Bake =============================================================== >>bake */

/* What building a terrain results in, as one block: for a file, for read-only memory, for a memory
   map. It holds no pointer and is used where it lies, on machines of the byte order that it was
   made on. Floats are IEEE 754 of 32 bits. The samples stay apart. */

#define TERRIMP_BAKE_VERSION 2u

/* What a bake says about itself. */
typedef struct terrimp_bake_info {
    size_t bytes;                /* of the block; what follows it is left alone */
    uint32_t width, depth;       /* of the heightfield that it was made of */
    int format;                  /* the same: terrimp_format */
    float height_scale, height_offset; /* [wu] the same; spacing and origin are free */
    uint32_t chunk_quads, triangle_budget;
    uint32_t level_count, node_count;
} terrimp_bake_info;

/* Looks at a bake: sizes, checksum, and every number in it, so that whatever block passes can be
   drawn without harm, also a crafted one; and, when there is a field, whether that still has the
   very samples which the bake was made of: open compares only its size, format, scale and offset.

   block      [bytes] aligned to 8 bytes
   field      NULL: not compared
   info       out; NULL: not wanted
   Errors     E_BAKE, also for another field; E_ORDER when it was made for the other byte order;
              those of terrimp_heightfield_resolve
   Cost       O(nodes), about 1 us for each, and with a field O(width * depth) */
TERRIMP_API terrimp_result terrimp_bake_check(const void *block, size_t bytes,
                                              const terrimp_heightfield *field,
                                              terrimp_bake_info *info);

/* The bytes of memory that a terrain needs which uses a bake where it lies. */
TERRIMP_API size_t terrimp_terrain_open_bytes(void);

/* Makes a terrain of a bake, without copying it: it can be drawn at once. Settings, such as
   chunk_quads and skirts, are those that it was built with.

   field          as in terrimp_terrain_desc
   block          [bytes] aligned to 8 bytes; outlives the terrain and does not change; read only
   memory         [memory_bytes] aligned to 8 bytes, at least terrimp_terrain_open_bytes
   terrain        out: lies in memory
   Errors         those of check and of terrimp_heightfield_resolve; E_BAKE for a field of another
                  size, format, scale or offset
   Cost           that of check */
TERRIMP_API terrimp_result terrimp_terrain_open(const terrimp_heightfield *field,
                                                const void *block, size_t bytes, void *memory,
                                                size_t memory_bytes, terrimp_terrain **terrain);

/* ==== Visibility ========================================================= >>visibility */

/* What lies behind a ridge need be neither drawn nor captured. Two things say which nodes do, only
   of nodes of which nothing can be seen: a horizon, found anew in each frame from the walls (bounds
   of the heights within each node); and visible sets, a table of what can be seen from where. Room
   Visible sets builds walls and table. A view asks what it is given as its `hider`:

     terrimp_horizon_init(&horizon, tree, walls);
     settings.hider = &horizon.hider; */

/* Something that hides nodes, of this room or the host's own: a struct that begins with this one.
   Its functions are called within terrimp_view_update: views that are updated one after the other
   may share one. */
typedef struct terrimp_hider {
    const terrimp_quadtree *tree; /* of the terrain */
    /* Begins a frame. What is drawn may be off its samples by `low` [wu]; and what hides may be off
       what it hides by `error` times its distance. The camera is resolved. Returns 0 when nothing
       is hidden in the frame. */
    int (*begin)(struct terrimp_hider *hider, const terrimp_camera *camera, float error, float low);
    /* Returns nonzero for a node all of which is hidden. */
    int (*hides)(struct terrimp_hider *hider, const terrimp_node *node);
    struct terrimp_hider *next;   /* asked of what this one does not hide: what takes more time;
                                     NULL: none */
    int blind;                    /* set by the view: what begin returned was 0 */
} terrimp_hider;

/* Private: walls and how they are kept. */
typedef struct terrimp_walls {
    const terrimp_quadtree *tree;
    const unsigned char *codes;
    uint32_t quads, cells; /* of a cell at level 0: 2 or 4; cells along a side of a node */
    uint32_t stride;       /* [bytes] from node to node */
} terrimp_walls;

/* Private: where an eye is, and what may be clipped round it. */
typedef struct terrimp_stand {
    float eye;         /* [wu] its height */
    uint32_t quad[2];  /* that it is over */
    float within[2];   /* its place in that, 0..1 */
    float error, low;  /* by which ground may be drawn off its samples: per distance, [wu] */
    float rounding;    /* [quads] of places */
    float clipped[2];  /* [quads] to where z_near may clip ground */
    float steepest;    /* slope of sight lines under which ground is clipped away */
} terrimp_stand;

/* --- the horizon --- */

/* Bytes of the walls of a tree: 0.18 a sample with chunks of 64 quads, 0.2 with 32, 0.3 with 16.
   0 when tree is NULL. */
TERRIMP_API size_t terrimp_walls_bytes(const terrimp_quadtree *tree);

enum {
    TERRIMP_HORIZON_BINS = 64,   /* directions in each of four quarters of the circle */
    TERRIMP_HORIZON_STEPS = 288, /* distances at which walls are looked at */
    TERRIMP_HORIZON_KEPT = 4     /* heights of the horizon that a bin remembers */
};

/* Private: a column or row of samples that sight lines cross. */
typedef struct terrimp_horizon_step {
    float distance, inverse; /* [quads] from the eye, along the axis */
    uint32_t line;           /* its column or row */
    uint16_t node;           /* the same among the nodes of the walls' level */
    uint8_t row;             /* among the walls of the node */
    uint8_t level;           /* 0: the samples themselves; else 1 + the level of the walls */
} terrimp_horizon_step;

/* Private: the horizon in one direction, as far as it was needed. */
typedef struct terrimp_horizon_bin {
    float distance[TERRIMP_HORIZON_KEPT]; /* where it rises, the latest at `top` */
    float slope[TERRIMP_HORIZON_KEPT];    /* to what */
    uint16_t reached, top;                /* steps that were looked at */
} terrimp_horizon_bin;

/* The horizon of one eye, about 28 KiB. */
typedef struct terrimp_horizon {
    terrimp_hider hider; /* for a view */
    terrimp_walls walls; /* private, all from here on */
    terrimp_stand stand;
    int blind;    /* nothing can be said to be hidden */
    float spread; /* [wu] longest horizontal distance of a point at distance 1 on an axis */
    float inverse[TERRIMP_HORIZON_BINS + 1];
    uint32_t step_count[4];
    terrimp_horizon_step steps[4][TERRIMP_HORIZON_STEPS]; /* towards +x, -x, +z, -z */
    terrimp_horizon_bin bins[4][TERRIMP_HORIZON_BINS];
} terrimp_horizon;

/* Makes a horizon over a terrain's walls.

   tree     built; outlives the horizon
   walls    [terrimp_walls_bytes] built, aligned to 4; the same */
TERRIMP_API terrimp_result terrimp_horizon_init(terrimp_horizon *horizon,
                                                const terrimp_quadtree *tree, const void *walls);

/* Begins the horizon of a camera. Ground that z_near clips hides nothing. An eye below the ground
   or beside the terrain has no horizon, nor have an orthographic camera or one with a reach:
   nothing is hidden from these, and that is no error.

   error    how far below its samples the ground in front may be drawn, over the distance to it:
            0 for full resolution; a picture that is up to n pixels off its place: n / K
            [Limits: 0..0.5]
   low      [wu] the same whatever the distance [Limits: >= 0]
   Errors   those of terrimp_camera_resolve
   Cost     about 3 us */
TERRIMP_API terrimp_result terrimp_horizon_begin(terrimp_horizon *horizon,
                                                 const terrimp_camera *camera, float error,
                                                 float low);

/* Whether all of a node lies below the horizon, as far as it lies between the left and the right
   side of the camera's view. Sure when it says so; what it does not find is up to a tenth of what
   is hidden in mountains, most of it in hills seen from above.

   horizon    begun; it goes on to be filled in
   node       [Limits: < node_count]
   raised     [wu] how far above its samples the node is drawn
   returns    nonzero: hidden; 0 also for bad arguments
   Cost       0.5 to 2 us, the first ones more
   Source     Lloyd and Egbert 2002, Horizon occlusion culling for real-time rendering of
              hierarchical terrain: the idea; bounds, walls and their proof are our own */
TERRIMP_API int terrimp_horizon_hides(terrimp_horizon *horizon, uint32_t node, float raised);

/* Takes the draws out of a selection that lie below the horizon; what is left keeps its order.
   Begins the horizon by itself, with the error of these draws.

   view       from terrimp_geomip_select with the same camera: draws, draw_count and triangle_count
              are changed
   Errors     those of begin: the draws are unchanged
   Cost       25 to 60 us in mountains */
TERRIMP_API terrimp_result terrimp_horizon_cull(terrimp_horizon *horizon,
                                                const terrimp_camera *camera,
                                                terrimp_geomip_view *view);

/* --- visible sets --- */

/* For each cell of the ground plane and each node the least height of an eye over the cell that can
   see any of the node: what sees a point sees it from farther up, too, so one number tells all. The
   look-up is a comparison of bytes. Cells are the nodes of one level, and nodes those of another
   and all above it: 16 x 16 cells of as many nodes take 64 KiB.

     sets.codes = malloc(terrimp_sets_bytes(tree, &sets));  cell_level, node_level: set before
     terrimp_sets_init(&sets, tree);                        then build or load the codes
     settings.hider = &sets.hider; */
typedef struct terrimp_sets {
    terrimp_hider hider; /* for a view */
    uint32_t cell_level; /* [Limits: < level_count] */
    uint32_t node_level; /* [Limits: < level_count] */
    float error, low;    /* what is drawn may be so far off, as in terrimp_hider [Limits: 0..0.5,
                            >= 0]: in a frame where it may be farther off nothing is hidden */
    float reach;         /* [wu] what eyes above a cell's lowest ground are told apart
                            [Default 0 -> three times the terrain's range of heights] */
    uint8_t *codes;      /* (required) [terrimp_sets_bytes] a row of nodes for each cell */
    const uint8_t *row;  /* private, all from here on: of the cell that the eye is over */
    uint32_t code;       /* of the eye's height */
    terrimp_stand stand;
} terrimp_sets;

/* Bytes of the codes; 0 for levels that the tree does not have. */
TERRIMP_API size_t terrimp_sets_bytes(const terrimp_quadtree *tree, const terrimp_sets *sets);

/* Checks settings, fills in defaults. The codes are left as they are: zeros hide nothing.

   tree     built; outlives the sets */
TERRIMP_API terrimp_result terrimp_sets_init(terrimp_sets *sets, const terrimp_quadtree *tree);

/* ==== Residency ========================================================== >>residency */

/* A terrain that is larger than memory lies in pages: a header, and for each node its ground, 65 x
   65 samples at its own step, its coarse mesh, and heights and errors of its four children. Pages
   are of one size and stand in a file, a cartridge or behind a network, children side by side; this
   header computes where, and never reads: a view lists what it wants, best first, and the host
   reads when and how it likes. What is not here is drawn by its parent. In memory are some slots
   for pages, and 2 bytes a node.

   How to use it: read the header, open the terrain, and read the root's page. Then in each frame

        terrimp_pages_next_frame(terrain);
        terrimp_view_update(view, &camera);
        terrimp_pages_wants(terrain, wants, 64, &count); // begin these, on any thread fill what
                                                         // begin has given; put, or fail
        terrimp_view_render(view, &draw);

   Begin, put and fail belong to the thread of the views, between update and render or after it. The
   pages that a frame uses stay where they are until the next frame's update. A page lies in its
   slot until another needs it, and what the host has made of it is good as long: a mesh has its
   place in the host's buffers by the slot (terrimp_terrain_get_mesh). Walls and visible sets are
   those of the same terrain in memory. A view's morph_ratio is the file's at most, with the rule
   PICTURE. */

#define TERRIMP_PAGES_VERSION 3u
#define TERRIMP_PAGES_HEADER_BYTES 8192u

/* What a header says. */
typedef struct terrimp_pages_info {
    uint64_t bytes;          /* of the whole file: the header, then all pages */
    uint32_t page_bytes;
    uint32_t width, depth;   /* samples */
    uint32_t chunk_quads, level_count, node_count;
    uint32_t block_level;    /* see terrimp_pages_desc */
    uint32_t stamp;          /* that all its pages bear: pages of another file are refused */
    float height_scale, height_offset;
    float morph_ratio;       /* of views, at most: see terrimp_pages_desc */
} terrimp_pages_info;

/* Looks at a header. Errors: E_BAKE when it is damaged or cut short; E_ORDER. */
TERRIMP_API terrimp_result terrimp_pages_check(const void *header, size_t bytes,
                                               terrimp_pages_info *info);

/* Bytes of the block that a terrain in pages lives in. 0 for a header or slots that are no good.

   slot_count  pages in memory at most [Limits: 8..65534] */
TERRIMP_API size_t terrimp_pages_bytes(const void *header, size_t bytes, uint32_t slot_count);

/* Makes a terrain of a header. Nothing of it is here yet: until the root's page is, a view's update
   returns E_PAGE.

   field       NULL, or where it lies: spacing and origin; the rest is that of the header
   memory      [memory_bytes] aligned to 8 bytes, at least terrimp_pages_bytes
   terrain     out: lies in memory, as a copy of all that it needs of the header */
TERRIMP_API terrimp_result terrimp_pages_open(const terrimp_heightfield *field, const void *header,
                                              size_t bytes, uint32_t slot_count, void *memory,
                                              size_t memory_bytes, terrimp_terrain **terrain);

/* Goes on after an edit: the blocks that reach to what was edited, and the end, have been built
   anew. The pages of the nodes that terrimp_terrain_touched lists are given up, the root's too, and
   have to come again; a host that reads them before the next update, root first, misses no frame.
   What views show of it is theirs to be told (terrimp_view_touch).

   header      [bytes] as it is now
   samples     that were edited; NULL: all
   Errors      E_STATE while a page is coming; E_BAKE when the header is damaged or of another file:
               nothing has changed */
TERRIMP_API terrimp_result terrimp_pages_renew(terrimp_terrain *terrain, const void *header,
                                               size_t bytes, const terrimp_rect *samples);

typedef enum terrimp_page_state {
    TERRIMP_PAGE_ABSENT = 0,
    TERRIMP_PAGE_COMING, /* begun, and neither put nor failed */
    TERRIMP_PAGE_HERE,
    TERRIMP_PAGE_STATE_COUNT
} terrimp_page_state;

/* Where a node's page stands. */
typedef struct terrimp_page_info {
    uint64_t offset; /* in the file */
    uint32_t bytes;
    uint32_t level;  /* of the node */
    int state;       /* terrimp_page_state */
    uint32_t slot;   /* unless it is absent */
} terrimp_page_info;
TERRIMP_API terrimp_result terrimp_page_get_info(const terrimp_terrain *terrain, uint32_t node,
                                                 terrimp_page_info *info);

/* Finds a slot for a node's page, in the place of the one that was of no use for longest.

   page        out: [bytes of the info] aligned to 8 bytes, to be filled, by any thread
   Errors      E_STATE when it is here or coming, or its parent is neither; E_CAPACITY when the
               frame uses all slots */
TERRIMP_API terrimp_result terrimp_page_begin(terrimp_terrain *terrain, uint32_t node, void **page);

/* Looks at a page that has been filled, and takes it if it is good. Else its slot is free again.

   Errors      E_STATE when it has not been begun; E_PAGE when its parent's page is not here: it
               stays, to be put again after that; E_BAKE when it is damaged, or another node's, or
               another file's
   Cost        O(samples), about 10 us */
TERRIMP_API terrimp_result terrimp_page_put(terrimp_terrain *terrain, uint32_t node);

/* Gives the slot of a page back that has been begun: it could not be read, or is not wanted any
   more. Nobody may fill it any longer. Errors: E_STATE when it has not been begun. */
TERRIMP_API terrimp_result terrimp_page_fail(terrimp_terrain *terrain, uint32_t node);

/* Begins a frame of all views of a terrain: what the frame before did not use may be given up, and
   what it wanted is forgotten. */
TERRIMP_API terrimp_result terrimp_pages_next_frame(terrimp_terrain *terrain);

/* Why a page is wanted. */
typedef enum terrimp_want_reason {
    TERRIMP_WANT_GROUND = 0, /* ground is drawn too coarse without it */
    TERRIMP_WANT_PICTURE,    /* a picture waits for it */
    TERRIMP_WANT_AHEAD,      /* it will be of use soon */
    TERRIMP_WANT_REASON_COUNT
} terrimp_want_reason;

typedef struct terrimp_want {
    uint32_t node, level, bytes;
    int reason;     /* terrimp_want_reason */
    float urgency;  /* the error that is seen without it, over its limit; below 1: not yet */
} terrimp_want;

/* The pages that the updates of this frame would have liked to have, those of all views, best
   first, and no more than there are slots for. None of them is here or coming; the parents of all
   are, or are listed before them.

   wants       [capacity] out
   count       out: how many */
TERRIMP_API terrimp_result terrimp_pages_wants(terrimp_terrain *terrain, terrimp_want *wants,
                                               uint32_t capacity, uint32_t *count);

/* Lists the pages that have been begun and that no view wanted in this frame and the one before, or
   whose parent's has failed.

   nodes       [capacity] out, by slot; count: how many there are, also when they are more */
TERRIMP_API terrimp_result terrimp_pages_withdrawn(const terrimp_terrain *terrain, uint32_t *nodes,
                                                   uint32_t capacity, uint32_t *count);

/* The height of a terrain, in pages or not, as terrimp_heightfield_height; the normal too.

   height      out [wu]
   normal      [3] out; NULL: not wanted
   level       out: of the finest ground that is here, which has answered; 0 is the exact one. NULL:
               only that will do, else E_PAGE */
TERRIMP_API terrimp_result terrimp_terrain_height(const terrimp_terrain *terrain, float x, float z,
                                                  float *height, float normal[3], uint32_t *level);

/* The first meeting of a ray and a terrain, in pages or not, as terrimp_heightfield_raycast.

   hit         out; x and z count in samples of the terrain. NULL: not wanted
   level       out: of the coarsest ground that was asked on the way; 0: all is exact. NULL: only
               that will do, else E_PAGE */
TERRIMP_API terrimp_result terrimp_terrain_raycast(const terrimp_terrain *terrain,
                                                   const float origin[3], const float direction[3],
                                                   float max_distance, terrimp_ray_hit *hit,
                                                   uint32_t *level);

/* ==== Capture ============================================================ >>capture */

/* Draw a ground node. */
typedef struct terrimp_ground_command {
    uint32_t node;        /* of any level: its vertices are those of terrimp_terrain_fill_ground */
    uint32_t level, x, z; /* its column and row on its level */
    uint32_t first_index; /* pattern, or a part of one: a range of the shared index buffer */
    uint32_t index_count;
    float morph;          /* morph factors, as in terrimp_geomip_draw; 0 without morphing */
    float side[TERRIMP_SIDE_COUNT];
    float side_coarse[TERRIMP_SIDE_COUNT];
    float offset[2];      /* [wu] x and z to be added to its vertices: 0, but in a terrain that
                             wraps. All that commands say in world units is with that offset */
} terrimp_ground_command;

/* Render a picture, or a piece of one: bind the atlas, set viewport and scissor to the slot, clear
   it to the farthest depth (for exact_depth only when `clear` is set, and the depth is kept) and,
   when `clear` is set, to transparent black. The ground commands up
   to end_capture are drawn with these matrices. */
typedef struct terrimp_capture_command {
    uint32_t node, level, x, z;
    uint32_t part;                  /* 0; or 1, for the back part of a picture in two parts: the
                                       matrices clip what lies before it */
    uint32_t atlas;                 /* < atlas_count */
    terrimp_rect slot;              /* y = 0 is row 0 of the texture */
    int clear;                      /* nonzero: the first piece of a picture. Pieces come back to
                                       front, each over those before */
    int complete;                   /* nonzero: the last piece */
    float view[16], projection[16];
    float eye[3];
    float clip_min[2], clip_max[2]; /* world (x, z): what belongs to the picture. The ground
                                       commands keep to it; cut a host's own models to it. */
} terrimp_capture_command;

/* ==== View =============================================================== >>view */

typedef struct terrimp_view terrimp_view; /* the pictures and lists of one camera */

/* What only some hosts want of a view, in their settings: a linker leaves out what no host asks
   for. */
typedef struct terrimp_endless terrimp_endless;
TERRIMP_API const terrimp_endless *terrimp_view_endless(void);
typedef struct terrimp_exact_depth terrimp_exact_depth;
TERRIMP_API const terrimp_exact_depth *terrimp_view_exact_depth(void);
typedef struct terrimp_cost_limit terrimp_cost_limit;
TERRIMP_API const terrimp_cost_limit *terrimp_view_cost_limit(void);

/* How the terrain is drawn. */
typedef enum terrimp_mode {
    TERRIMP_MODE_DEFAULT = 0, /* same as AUTO */
    TERRIMP_MODE_FULL,        /* ground at full resolution: the yardstick */
    TERRIMP_MODE_GEOMIP,      /* ground at the tolerance, and no impostors */
    TERRIMP_MODE_IMPOSTOR,    /* after Hess: full-resolution ground up to the fade band, beyond it
                                 every chunk is an impostor */
    TERRIMP_MODE_AUTO,        /* each node as what costs least within the tolerance: ground, or an
                                 impostor of its level */
    TERRIMP_MODE_COUNT
} terrimp_mode;

/* What drawing costs on the host's machine, in a unit of its choice: only ratios matter. The
   defaults are triangles, as a software rasteriser was measured to need. */
typedef struct terrimp_costs {
    float draw;        /* one draw call [Limits: >= 0] [Default 0 -> 40] */
    float triangle;    /* one triangle with its share of vertices [Limits: >= 0] [Default 0 -> 1] */
    float ground_px;   /* to shade a pixel of ground [Limits: >= 0] [Default 0 -> 0.25] */
    float impostor_px; /* to shade a pixel of an impostor [Limits: >= 0] [Default 0 -> 0.25] */
    float capture;     /* to begin and end a capture [Limits: >= 0] [Default 0 -> 1400] */
} terrimp_costs;

/* The settings of a view. */
typedef struct terrimp_view_desc {
    int mode;               /* terrimp_mode */
    float tolerance_px;     /* an impostor whose picture has a larger parallax error is renewed
                               [Limits: 0.05..100] [Default 0 -> 1] */
    float ground_tolerance_px; /* error of ground in GEOMIP and AUTO, by ground_rule
                               [Limits: 0.05..100] [Default 0 -> half of tolerance_px] */
    int ground_rule;        /* terrimp_geomip_rule */
    const terrimp_bound *bound; /* (required for ground_rule BOUND) terrimp_geomip_bound() */
    float morph_ratio;      /* of ground in GEOMIP and AUTO: see terrimp_geomip_view
                               [Limits: 1..4] [Default 0 -> 1] */
    float fade_start;       /* [wu] from the eye: nodes that come closer are ground
                               [Default 0 -> 2 chunk sides; in AUTO 2 / tolerance_px, but 1 to 2] */
    float fade_end;         /* [wu] from the eye: nodes beyond it need no ground; between the two
                               impostors fade in over it [Limits: > fade_start]
                               [Default 0 -> 1.5 * fade_start; in AUTO 1.1] */
    float max_angle_rad;    /* a picture seen from farther round than this is renewed
                               [Limits: 0.001..1.5] [Default 0 -> 0.0873 (5 degrees); in AUTO so
                               much times the root of tolerance_px, but 5 to 15 degrees] */
    float texels_per_px;    /* sharpness of a picture when it is made; 0.7 of it where the atlases
                               are full: what has no room even then is ground
                               [Limits: 0.1..8] [Default 0 -> 2; in AUTO 2 over the root of
                               tolerance_px, but 0.7 to 2] */
    float impostor_px;      /* AUTO: an impostor whose side covers more pixels is split
                               [Limits: 8..4096] [Default 0 -> 320] */
    uint32_t atlas_size;    /* texels along the side of each of the host's atlas textures
                               [Limits: 64..32768] [Default 0 -> 4096] */
    uint32_t atlas_count;   /* atlas textures [Limits: 1..16] [Default 0 -> 1] */
    uint32_t max_slot;      /* texels along a side of a picture's slot at most: what would need more
                               is coarser, and ground where 0.7 texels_per_px would need more
                               [Limits: 12..atlas_size] [Default 0 -> half of atlas_size] */
    uint32_t max_impostors; /* pictures kept at most [Limits: 1..65534] [Default 0 -> 1024] */
    uint32_t max_ground;    /* ground nodes drawn at most; AUTO and GEOMIP coarsen the ground rather
                               than exceed it, FULL and IMPOSTOR need the chunks in sight
                               [Default 0 -> all chunks; in GEOMIP and AUTO at most 4096] */
    uint32_t max_captures;  /* pictures begun in one frame at most. What waits is drawn from older
                               pictures or as ground [Limits: 1..1024] [Default 0 -> 64] */
    uint32_t max_capture_texels;    /* the same in texels [Default 0 -> no limit] */
    uint32_t max_capture_triangles; /* the same in triangles; a picture that needs more is made in
                                       pieces, over several frames [Default 0 -> no limit] */
    int no_lookahead;       /* nonzero: pictures are made from where the eye is; else from a place
                               ahead of it, where they last longer */
    int no_splits;          /* nonzero: no picture is made in two parts; else in AUTO a picture that
                               would show a ridge smeared over the slope behind it is */
    int no_spreading;       /* nonzero: a picture is renewed when it is due; else some frames before
                               or after that, so that the load of frames is even */
    int sorted;             /* nonzero: draws come in painter's order, for hosts without a depth
                               buffer: see terrimp_sorted_ground and terrimp_sorted_mesh */
    const terrimp_exact_depth *exact_depth; /* terrimp_view_exact_depth(): impostor commands carry a
                               place_matrix, so that their pixels can have the terrain's own depth
                               instead of the coarse mesh's [Default NULL -> they do not] */
    const terrimp_endless *endless; /* (required for a terrain whose field wraps)
                               terrimp_view_endless(): it is drawn without end. Its quads are
                               multiples of chunk_quads; nodes are drawn up to the level at which
                               its chunks are no multiple of theirs. No hider then */
    uint32_t wrap_tiles;    /* as so many repetitions along each axis, with the eye's in the middle;
                               each takes 44 bytes for each node
                               [Limits: odd, 3..15; 65537 samples an axis] [Default 0 -> 3] */
    const terrimp_cost_limit *cost_limit; /* (required for max_cost) terrimp_view_cost_limit() */
    float max_cost;         /* of a frame, in the unit of costs, in AUTO and GEOMIP: what its draws
                               and captures are predicted to cost. The ground is coarsened until
                               they fit, and made finer again when that is predicted to fit, too;
                               captures are made in pieces, of single rows of quads if need be,
                               that leave no frame dearer
                               [Limits: >= 0] [Default 0 -> no limit] */
    terrimp_hider *hider;   /* of the terrain's quadtree, outliving the view: what it hides is
                               neither drawn nor captured: see terrimp_horizon, terrimp_sets
                               [Default NULL -> nothing is hidden so] */
    uint32_t joined;        /* bit i: beyond side i (TERRIMP_SIDE_...) another terrain goes on, with
                               this one's border samples as its own: the floor is drawn for eyes
                               over that one, too, so that no sky shows between the two
                               [Limits: 0..15] */
    terrimp_costs costs;
} terrimp_view_desc;

/* Draw a coarse mesh with its picture. With (s, t, r, q) the texture matrix times
   (position - eye, 1), the colour is that of the atlas at (s / q, t / q), bilinear, divided by its
   alpha; where alpha is below 0.5 nothing is drawn, depth neither. Of a picture in two parts both
   are drawn, each only where r / q is within 0..1: by a discard, or by the clip planes r >= 0 and
   q - r >= 0, which are rows of the matrix.
   Draw both sides of it, but in painter's order only counter-clockwise faces. Where the eye is
   over the ground a side that is turned away shows the sky through, or else a hole is closed: a
   ray that leaves the ground has come in, so where it leaves is terrain. A picture made from
   elsewhere may be transparent at the ridge where it came in; then it goes on below the surface,
   and out of the mesh: over its back, or below its border, through the skirt there, which reaches
   from above all of the ground beside it to below (see terrimpi_mesh_skirt_foot); or it stays
   down, and meets the floor. */
typedef struct terrimp_impostor_command {
    uint32_t node, level, x, z;
    uint32_t part, part_count;
    uint32_t atlas;
    uint32_t base_vertex; /* of the buffers of terrimp_terrain_fill_meshes */
    uint32_t first_index;
    uint32_t index_count;
    float alpha;          /* 1; or, in the fade band, the share of the pixels that it is drawn on,
                             by a dither pattern: its ground shows on the others */
    float eye[3];         /* that the picture was made from: positions are relative to it */
    float texture_matrix[16];
    float place_matrix[16]; /* with exact_depth: takes (s / q, t / q, d, 1), d the depth that the
                             picture has there, 0..1, to the place relative to the frame's eye,
                             times a factor. For a host that keeps the depth of its atlases and
                             writes the farther of that place's depth and the mesh's own, which
                             is in front of a slope that was hidden from the picture, but behind
                             the ridge that hid it: see terrimp_place_matrix. Else 0 */
    float offset[2];      /* [wu] as for ground */
} terrimp_impostor_command;

/* Draw the floor, with the ground's own shading, opaque: a surface of a few triangles that lies
   below all of the terrain, with walls up to its outer border, without a gap. It comes after the
   impostors and shows only where none of them does: a slope that was hidden when its picture was
   made. Its pixels are terrain in truth too: no holes are left. (An eye beside the terrain could
   see some of it where the sky is, and one under the ground all of it: that is not drawn, and from
   beside nothing of it unless max_angle_rad is over 0.1.) Vertices and indices as for impostors.
   From beside there come, with any settings, skirts of coarse ground: walls at the outer border,
   from a segment of it down to the samples below. Paged terrain has none, and of terrain with
   sides of over 3,900 quads the finest levels have none. */
typedef struct terrimp_floor_command {
    uint32_t base_vertex;
    uint32_t first_index; /* from mesh_index_count - floor_index_count on; for an eye beside the
                             terrain there may be several parts, a command each, and skirts */
    uint32_t index_count;
    float offset[2]; /* [wu] as for ground; one floor for each repetition */
} terrimp_floor_command;

/* What a host implements. A command is valid during the call; copy it to keep it. Callbacks run on
   the thread of terrimp_view_render and may not call functions of the same view, but
   terrimp_view_drop for captures. */
typedef struct terrimp_callbacks {
    void *user; /* first argument of each */
    void (*begin_capture)(void *user, const terrimp_capture_command *command);
    void (*end_capture)(void *user, const terrimp_capture_command *command);
    void (*draw_impostor)(void *user, const terrimp_impostor_command *command);
    void (*draw_ground)(void *user, const terrimp_ground_command *command);
    void (*draw_floor)(void *user, const terrimp_floor_command *command); /* NULL: not wanted */
} terrimp_callbacks;

/* What the last update decided. */
typedef struct terrimp_stats {
    uint32_t visible;            /* nodes of which it was decided what they are drawn as */
    uint32_t hidden;             /* nodes behind ridges that were left out, each with all in it */
    uint32_t ground;             /* ground nodes drawn */
    uint32_t impostors;          /* impostors drawn */
    uint32_t impostors_by_level[TERRIMP_QUADTREE_LEVELS];
    uint32_t waiting;            /* impostors that were wanted and have no picture yet */
    uint32_t draws;              /* commands on the screen */
    uint32_t triangles;          /* of those */
    uint32_t captures;           /* pictures, or pieces of them, to be made */
    uint32_t splits;             /* pictures among them that are made in two parts */
    uint32_t captured_texels;
    uint32_t captured_triangles;
    uint32_t captures_due;       /* pictures that the tolerances wanted renewed */
    float shortfall;             /* part of these that was put off, 0..1 */
    float reuse;                 /* for how many frames a picture is drawn, a running mean */
    uint64_t texels_used, texels_free; /* of all atlases */
    uint32_t atlas_failures;     /* pictures that found no room, so far */
    uint32_t evictions;          /* pictures given up for others, so far */
    uint32_t late;               /* nodes and pictures that pages were missing for */
    float ground_tolerance_px;   /* what max_ground and max_cost made of it */
    float cost;                  /* of the frame, predicted: all but what is shaded either way */
    float worst_angle_rad;       /* of the impostors on the screen */
    float worst_parallax_px;     /* the same: predicted parallax error */
    float z_near, z_far;         /* [wu] clip distances along forward that cut nothing of what is
                                    drawn, for a host that wants to draw with these; z_near is 0
                                    within a box */
} terrimp_stats;

/* Writes the effective settings for a terrain, defaults filled in. out may be desc. */
TERRIMP_API terrimp_result terrimp_view_desc_resolve(const terrimp_terrain *terrain,
                                                     const terrimp_view_desc *desc,
                                                     terrimp_view_desc *out);

#ifndef TERRIMP_NO_TROUBLE
/* As terrimp_heightfield_trouble; `costs` stands for each of its fields. */
TERRIMP_API const char *terrimp_view_desc_trouble(const terrimp_terrain *terrain,
                                                  const terrimp_view_desc *desc);
#endif

/* Bytes of the block that a view lives in; 0 when an argument is wrong or the size overflows. */
TERRIMP_API size_t terrimp_view_bytes(const terrimp_terrain *terrain,
                                      const terrimp_view_desc *desc);

/* Lays a view out in the caller's block. Any number of views may share one terrain.

   terrain    built; outlives the view
   memory     [bytes] aligned to 8 bytes
   view       out: lies in memory */
TERRIMP_API terrimp_result terrimp_view_init(const terrimp_terrain *terrain,
                                             const terrimp_view_desc *desc, void *memory,
                                             size_t bytes, terrimp_view **view);

/* Changes settings from the next update on. Pictures that are good enough by the new ones stay.

   desc       as for terrimp_view_init, but for what the view has memory for: atlas_size,
              atlas_count, max_impostors, max_ground, max_captures, endless and wrap_tiles are those
              of before, or 0; exact_depth only if the view was made with it
   Errors     those of terrimp_view_desc_resolve; E_RANGE when one of these is another: nothing
              changes */
TERRIMP_API terrimp_result terrimp_view_set(terrimp_view *view, const terrimp_view_desc *desc);

/* Decides the frame: what is visible, what is drawn how, which pictures are made. A view serves
   perspective or orthographic cameras, and forgets its pictures from one kind to the other.

   Errors     E_CAPACITY when more than max_ground chunks are in sight in mode FULL or IMPOSTOR, or
              more nodes in GEOMIP and AUTO even at 1000 px; E_PAGE when the page of the root is not
              here. The frame before stays
   Cost       O(nodes in sight); no allocation */
TERRIMP_API terrimp_result terrimp_view_update(terrimp_view *view, const terrimp_camera *camera);

/* Calls back with the frame's commands: captures, each with its ground; the ground; impostors; the
   floor; from beside, skirts. Each kind front to back: what is hidden by something drawn before it
   need not be shaded. With `sorted`: captures, the floor, skirts, then ground and impostors as they
   come, farthest first, and of a picture in two parts the back part first.
   An update may be rendered any number of times: captures come with the first one, all other
   commands are the same again. They serve every eye within the camera's reach that looks through
   its sides, each with matrices of its own; a place_matrix is relative to the update's eye. An
   update that is never rendered makes no picture, and loses none.

   Errors     E_NULL when a callback that is needed is missing: nothing has been called; E_STATE
              before the first update, and after invalidate, touch and drop until the next one */
TERRIMP_API terrimp_result terrimp_view_render(terrimp_view *view,
                                               const terrimp_callbacks *callbacks);

/* The max_cost of the next frames, or max_triangles of room Sorted, from what the last one took,
   for a host that measures: at most a twentieth less or a fiftieth more, the same within 3 % of the
   target. No clock inside, and it settles where time rises with cost, and no faster than it does. A
   pause costs one step.

   cost        that the frame was allowed; ms that it took; target_ms that it should take. What is
               not above 0, or not finite: the cost stays */
TERRIMP_API float terrimp_view_pace(float cost, float ms, float target_ms);

/* The statistics of the last update, counted when they are asked for. Errors: E_STATE also after
   invalidate, touch and drop, until the next update. */
TERRIMP_API terrimp_result terrimp_view_get_stats(const terrimp_view *view, terrimp_stats *stats);

/* Forgets every picture, for instance when textures were lost. */
TERRIMP_API terrimp_result terrimp_view_invalidate(terrimp_view *view);

#define TERRIMP_EVERY_NODE 0xffffffffu

/* Makes the picture of a node due, or that of TERRIMP_EVERY_NODE: it is worn until the schedule has
   renewed it. For what has changed, but not so that the old pictures would be wrong. */
TERRIMP_API terrimp_result terrimp_view_expire(terrimp_view *view, uint32_t node);

/* Says where the light comes from, from the next update on. Pictures whose light came from farther
   round are due, each at a share of the tolerance of its own, 0.7 to 1, so that not all are due at
   once; and impostors cost what such captures do. Not called, light is no matter.

   direction        [3] towards the light, any length > 0; NULL: no matter any more
   tolerance_rad    [Limits: 0.001..3.1] [Default 0 -> 0.0157: where it shines on matt ground, 4 of
                    255 grey levels at most] */
TERRIMP_API terrimp_result terrimp_view_light(terrimp_view *view, const float direction[3],
                                              float tolerance_rad);

/* Forgets the picture of a node, or that of TERRIMP_EVERY_NODE: the host could not make it, or has
   lost it. It is the one function of a view that begin_capture, end_capture and what is called
   between the two may call: what the picture should have shown is then drawn from others or as
   ground, in this same render. Called from elsewhere, an update has to come first. */
TERRIMP_API terrimp_result terrimp_view_drop(terrimp_view *view, uint32_t node);

/* Forgets the pictures that show a rectangle of samples, after an edit.

   x, z       column and row of the first sample [Limits: inside the field]
   cols, rows size in samples [Limits: >= 1]; what reaches over the last column and row is cut */
TERRIMP_API terrimp_result terrimp_view_touch(terrimp_view *view, uint32_t x, uint32_t z,
                                              uint32_t cols, uint32_t rows);

#ifndef TERRIMP_NO_MALLOC

/* Allocates and lays out a view. Errors: those of init; E_MEMORY when there is none. */
TERRIMP_API terrimp_result terrimp_view_create(const terrimp_terrain *terrain,
                                               const terrimp_view_desc *desc,
                                               const terrimp_allocator *allocator,
                                               terrimp_view **view);
TERRIMP_API void terrimp_view_destroy(terrimp_view *view);

#endif /* TERRIMP_NO_MALLOC */

/* ==== Sorted ============================================================= >>sorted */

/* Terrain for machines without a depth buffer: squares of two or more triangles, given out one
   after the other in exact painter's order, or the other way round, with a level of detail that
   changes without a pop. Endless if the field wraps. It needs no tree, no building and no memory
   but one struct. After Finch and Bishop, with three differences that make it exact: the order;
   levels that are a function of the place alone, so that both sides of an edge know each other's
   without looking at what was drawn; and blending that is over before a finer level begins.

   Pages are the extent of a texture, page_quads quads along a side. A page is cut into squares of
   2^level quads, aligned to their size, the smaller the closer to the eye; where a square borders
   on smaller ones, its triangles meet at the middle of that side.

   How to use it: init once; each frame begin with the camera, then next until it returns 0. */

/* Heights of vertices. With TERRIMP_FIXED, for machines without floats, next does not use any:
   heights are 256ths of a step of a sample, before height_scale and height_offset. */
#ifdef TERRIMP_FIXED
typedef int32_t terrimp_sorted_height;
typedef int32_t terrimp_sorted_int; /* private: squares of distances */
#else
typedef float terrimp_sorted_height; /* [wu] */
typedef int64_t terrimp_sorted_int;
#endif

enum {
    TERRIMP_SORTED_LEVELS = 11,  /* of pages of 1024 quads */
    TERRIMP_SORTED_SIDES = 8,    /* of a footprint, at most */
    TERRIMP_SORTED_ABSENT = 255  /* the level of a page of which nothing is here */
};

/* A page, for the callback that knows where its samples are. */
typedef struct terrimp_sorted_page {
    int32_t x, z;           /* which: column and row of pages, from the origin on, any sign */
    int only_level;         /* nonzero: only level is asked for, of a page beside one to be drawn */
    uint32_t level;         /* in: 0. out: the finest level that is here, which may be as coarse as
                               the page: then it is drawn from its corners. ABSENT: not drawn */
    const void *samples;    /* out: every 2^level-th sample of every 2^level-th row, as in field;
                               the first and the last are those of the neighbours */
    size_t row_bytes;       /* out */
    uint32_t texture_level; /* in: wanted. out: to be drawn with */
} terrimp_sorted_page;

typedef struct terrimp_sorted_desc {
    terrimp_heightfield field; /* (required) it wraps if its wrap is set, which wants whole pages:
                                  width - 1 and depth - 1 are multiples of page_quads. With a page
                                  callback width, depth, wrap and samples have no meaning, and
                                  there is no end in any direction */
    uint32_t page_quads;       /* along a page's side [Limits: a power of two, 2..1024]
                                  [Default 0 -> 64] */
    float low, high;           /* [wu] no height lies outside [Default 0, 0 -> those of the field:
                                  init reads it once. Required with a page callback] */
    float scale;               /* [quads] a square of level l is closer than scale * 2^(l + 1), so
                                  that all look about equally large [Limits: >= 2]
                                  [Default 0 -> 12] */
    const float *table;        /* [page levels] instead of 2^l: level l, from 1 on, begins at
                                  scale * table[l] quads. scale has to be so large that it rises
                                  by 2 * 2^l from level l to the next. NULL: 2^l */
    uint32_t max_triangles;    /* not 0: each frame's scale is the one that leads to 97 to 100 % of
                                  so many, as far as there is one. A host that measures has it
                                  from terrimp_view_pace */
    int front_to_back;         /* nonzero: the other way round */
    float low_far;             /* [wu] z_far of an eye on the ground, for a horizon that comes in
                                  as the eye sinks [Limits: >= 0] [Default 0 -> z_far] */
    float low_height;          /* [wu] above the ground, from which on z_far is the camera's
                                  [Limits: > 0] [Default 0 -> high - low] */
    uint32_t page_texels;      /* along a side of a page's finest texture [Default 0 -> 256] */
    uint32_t texture_level_count; /* [Limits: 1..16] [Default 0 -> 1] */
    float texels_per_px;       /* [Limits: > 0] [Default 0 -> 1] */
    uint8_t *texture_levels;   /* [texture_window^2] the caller's, 255 at first: remembered so that
                                  a page at a level's border does not flicker. NULL: it may */
    uint32_t texture_window;   /* pages remembered along each axis, a power of two: as many as
                                  z_far spans, or distant ones forget [Default 0 -> 32] */
    void *user;                /* first argument of page */
    void (*page)(void *user, terrimp_sorted_page *page); /* where a page's samples are. Called by
                                  next for each page and its neighbours. NULL: in field */
} terrimp_sorted_desc;

typedef struct terrimp_sorted_vertex {
    int32_t x, z; /* column and row of samples, from the origin on, any sign */
    terrimp_sorted_height height;
} terrimp_sorted_vertex;

/* What next gives out. */
typedef struct terrimp_sorted_square {
    int32_t page_x, page_z; /* column and row of its page, from the origin on, any sign */
    uint8_t level;          /* 2^level quads along a side */
    uint8_t texture_level;  /* of the page */
    uint8_t vertex_count, triangle_count; /* up to 6 and 4 */
    uint8_t indices[12];    /* of triangles, in order */
    terrimp_sorted_vertex vertices[6]; /* its corners (0, 0), (1, 0), (0, 1), (1, 1); middles */
} terrimp_sorted_square;

/* Private: a square on the way to the present one, and the 3 x 3 places at which its quarters have
   their corners: column + 4 * row. */
typedef struct terrimp_sorted_cell {
    int32_t at[2];                     /* its first sample, from that of its page on */
    terrimp_sorted_int away[2][3];     /* units from the eye to the places along each axis */
    terrimp_sorted_height heights[11]; /* of the places, before scale and offset */
    uint8_t crossed;                   /* by sides of the footprint */
    uint8_t child, order;              /* quarters that were looked at; the first: x + 2 z */
} terrimp_sorted_cell;

/* Private: a side of the footprint, inside of which x * its x + z * its z + at >= 0. */
typedef struct terrimp_sorted_side {
    terrimp_sorted_int at;
    int32_t x, z;
    int32_t fall, rise; /* of that, at most, across a square of a sample */
} terrimp_sorted_side;

/* The state of a terrain and of its frame. The caller's, 2 KiB; all but two are private. */
typedef struct terrimp_sorted {
    terrimp_sorted_desc desc; /* resolved */
    float scale;              /* of this frame */
    uint32_t triangle_count;  /* given out so far in this frame */

    uint32_t top;                /* level of a page */
    uint32_t pages[2];           /* of the field, along x and z */
    float least_scale;
    int row_axis;                /* along which rows lie: 0 x, 1 z */
    int32_t eye_page[2];         /* what follows counts from this page's first sample on */
    terrimp_sorted_int eye[2], unit[2], rise; /* units; units a sample; squared */
    terrimp_sorted_int limit;    /* units that can be squared */
    terrimp_sorted_int split[TERRIMP_SORTED_LEVELS + 1]; /* squared, as are these: a closer square
                                    of this level is split */
    terrimp_sorted_int whole[TERRIMP_SORTED_LEVELS]; /* up to here a vertex has its own height */
    float fade[TERRIMP_SORTED_LEVELS]; /* 1 / (split of the next level - whole) */
    terrimp_sorted_int texel_steps[2]; /* squared: where level 1 begins, and where it is left */
    uint32_t side_count;
    terrimp_sorted_side sides[TERRIMP_SORTED_SIDES];
    int32_t bounds[2][2];        /* of the footprint: first and last page along each axis */
    int32_t rows, row, cols, col, first_col, page_row; /* pages that there are, and are done */
    int32_t corner[2];           /* first sample of the page */
    terrimp_sorted_page page;
    int partial;                 /* not all of it is in the field, or here, or beside it */
    uint8_t side_levels[4];      /* from which on heights along its sides are here */
    int32_t last[2];             /* column and row of the page's last sample in the field */
    uint32_t level;              /* of the present square; what it is a part of lies above it */
    terrimp_sorted_cell cells[TERRIMP_SORTED_LEVELS];
    terrimp_sorted_int way[2], away; /* to its closest point, along each axis, and squared */
} terrimp_sorted;

/* Writes the effective descriptor; low and high stay. out may be in.
   Errors: E_RANGE also for a table that does not rise enough, and for F32 with TERRIMP_FIXED. */
TERRIMP_API terrimp_result terrimp_sorted_desc_resolve(const terrimp_sorted_desc *in,
                                                       terrimp_sorted_desc *out);

/* Makes the state ready for frames.

   Errors     where the field is read for low and high, E_VOID, E_NOT_FINITE for such a sample
   Cost       O(width * depth) if low and high are 0, else O(1) */
TERRIMP_API terrimp_result terrimp_sorted_init(const terrimp_sorted_desc *desc,
                                               terrimp_sorted *sorted);

/* Begins a frame: finds the footprint of the camera and, with max_triangles, the scale.

   Errors     E_RANGE also when the eye is more than 2^23 samples from the origin, or when z_far
              reaches over more than 1024 pages, with TERRIMP_FIXED also 2048 quads less three
              pages; or for a camera that is orthographic, or without a far plane. After any error
              next returns 0
   Cost       about 2 us; with max_triangles one to two thirds of what next takes for the whole
              frame, more for the first
   Source     Finch and Bishop 1998, sections 4.3 and 4.10 */
TERRIMP_API terrimp_result terrimp_sorted_begin(terrimp_sorted *sorted,
                                                const terrimp_camera *camera);

/* Gives out the next squares. What stands on a square and does not reach over its sides may be
   drawn right after it (front to back: right before it), and is hidden as it should be.

   squares    [capacity] out
   Returns    how many; less than capacity, or 0, at the end of the frame
   Cost       70 to 100 cycles a triangle of a processor of 2020, whatever came before
   Source     Finch and Bishop 1998, sections 4.4 to 4.9 */
TERRIMP_API uint32_t terrimp_sorted_next(terrimp_sorted *sorted, terrimp_sorted_square *squares,
                                         uint32_t capacity);

/* Makes the next coarser level of a map or of a page of it: every second texel, mixed with those
   around it, 1 2 1 along each axis. Texels on the border are mixed along the border alone and so
   need no neighbouring page: pages whose borders are the same texels keep that. Filter the whole
   map and cut it then, which is better still, or filter its pages one by one; not a page together
   with a border of its own invention.

   texels      [height][width][channels]
   width, height  [Limits: odd, 3..65537]
   channels    [Limits: 1..4]
   wrap        nonzero: the map repeats, its last column and row being the first ones
   out         [height / 2 + 1][width / 2 + 1][channels]; must not overlap texels
   Cost        O(width * height)
   Source      Finch and Bishop 1998, section 4.8, asks for equal edges */
TERRIMP_API terrimp_result terrimp_sorted_halve(const uint8_t *texels, uint32_t width,
                                                uint32_t height, uint32_t channels, int wrap,
                                                uint8_t *out);

/* The indices of a ground node, or of the strip of one that a capture draws, in exact painter's
   order for an eye: for the draws of a view, which come in that order when its settings say
   `sorted`. Nothing but the eye's place within or beside the node counts.

   command      its node and indices count
   eye          of the frame, for the ground of a capture that of the capture's command, less the
                offset of the ground's [wu]
   indices      [capacity] out: over the same vertices, farthest triangle first; with all of the
                pattern's triangles, but none of no area
   count        out. Never more than the command's index_count
   Cost         O(quads); about 20 cycles a triangle of a processor of 2020 */
TERRIMP_API terrimp_result terrimp_sorted_ground(const terrimp_terrain *terrain,
                                                 const terrimp_ground_command *command,
                                                 const float eye[3],
                                                 uint16_t *indices, size_t capacity,
                                                 uint32_t *count);

/* Puts the triangles of a coarse mesh into painter's order for an eye, in place: walls that face
   away from it, the surface, which has to be convex as seen from above, and the walls that face the
   eye, below the surface's closest borders. Where triangles hide each other in a circle there is no
   such order: then one of them comes before what is beyond it.

   xyz         [vertex_count][3] as terrimp_terrain_fill_mesh writes them, floats
   eye         of the frame [wu]
   indices     [index_count] in, out [Limits: of index_count: a multiple of 3, < 65536]
   scratch     [vertex_count + 3 * index_count] of the caller
   circles     out: how many times that was so; NULL: not wanted
   Errors      E_RANGE also for an index that is too large
   Cost        O(index_count) */
TERRIMP_API terrimp_result terrimp_sorted_mesh(const float *xyz, uint32_t vertex_count,
                                               const float eye[3], uint16_t *indices,
                                               uint32_t index_count, uint16_t *scratch,
                                               uint32_t *circles);

/* The world position of a vertex [wu]. No pointer may be null. */
TERRIMP_API void terrimp_sorted_position(const terrimp_sorted *sorted,
                                         const terrimp_sorted_vertex *vertex, float position[3]);

/* ==== Layers ============================================================= >>layers */

/* A piece of scenery, for instance a wood or a village, as pictures that stand one behind the
   other: its layers. All are taken from one reference point, in the middle of the side of a view
   cell that faces the scenery, and serve every eye in that cell. Each shows what lies between two
   depths. They stand so close that between two of them nothing shows through, and so that nothing
   appears farther than an allowed angle from where it is. Depths are measured from the reference
   point along the direction of view. Room Layer builder makes them. */
typedef struct terrimp_layers {
    uint32_t count;        /* layer 0 is the closest */
    uint32_t even_count;   /* this layer and those before it are evenly spaced in 1 / depth */
    float start, end;      /* [wu] the depths that they stand for; end may be infinite */
    float first, last;     /* 1 / depth of the first and of the last layer */
    float step;            /* by which 1 / depth falls from one evenly spaced layer to the next */
    float shrink, shift;   /* beyond: by which part of itself, and by how much else, it falls */
    float texel;           /* tangent that one texel of each layer covers at the reference point */
} terrimp_layers;

/* The depth at which a layer stands [wu]. layers is not null, layer < its count. O(log(count)). */
TERRIMP_API float terrimp_layer_depth(const terrimp_layers *layers, uint32_t layer);

/* The depth at which layer - 1 ends and layer begins [wu]: start for 0, end for count. In between
   what is off by parallax is shared equally: Jeschke 2004, equation 3.6, which at the reference
   point is the middle in 1 / depth. */
TERRIMP_API float terrimp_layer_border(const terrimp_layers *layers, uint32_t layer);

/* The layer that stands for a depth; the first or the last one for depths out of the range.
   O(log(count)^2). */
TERRIMP_API uint32_t terrimp_layer_of(const terrimp_layers *layers, float depth);

/* A rectangle of a layer that is drawn. */
typedef struct terrimp_layer_quad {
    terrimp_rect texels; /* of the layer's picture; row 0 is the lowest */
    uint32_t layer;
    uint32_t x, y;       /* where the atlas holds its lowest left texel */
} terrimp_layer_quad;

/* Corners and texture coordinates of a quad, counter-clockwise as the cell sees it. Its texture
   needs no perspective: the quad is parallel to the picture.

   picture     the capture of the layers: eye at the reference point; texels of layers->texel count
               from tan_left and tan_down
   atlas       [2] width and height of the atlas [texels]
   xyz         [4][3] out [wu]
   st          [4][2] out, 0..1 over the atlas; may be NULL
   Cost        O(log(count)) */
TERRIMP_API terrimp_result terrimp_layer_corners(const terrimp_layers *layers,
                                                 const terrimp_capture *picture,
                                                 const terrimp_layer_quad *quad,
                                                 const uint32_t atlas[2], float xyz[12],
                                                 float st[8]);

/* A vertex of a depth mesh, in the grid of its layers: column and row of the picture in texels, and
   the layer, whole numbers at the layers themselves. One unit in any direction is about one pixel
   from where it shows most. With layers planned `even` planes of the world are planes in it. */
typedef struct terrimp_depth_vertex {
    float u, v, layer;
} terrimp_depth_vertex;

/* Where the vertices of a depth mesh stand in the world.

   vertices    [count]
   xyz         [count][3] out [wu]
   Cost        O(count * log(layers)) */
TERRIMP_API terrimp_result terrimp_depth_points(const terrimp_layers *layers,
                                                const terrimp_capture *picture,
                                                const terrimp_depth_vertex *vertices,
                                                uint32_t count, float *xyz);

/* ==== stop here if you only draw what has been built ====================== */

#ifndef TERRIMP_NO_BUILD

/* ==== Simplifier ========================================================= >>simplifier */

#define TERRIMP_MAX_TILE_DIM 257u    /* samples along one side of a tile at most */
#define TERRIMP_MAX_TRIANGLES 8192u  /* of a surface at most; every index fits 16 bits */

/* A kept point of a border polyline. */
typedef struct terrimp_border_point {
    uint16_t at;  /* sample of the border that it stands on, counted from 0 */
    float height; /* [wu] fitted; at both ends the sample's own height */
} terrimp_border_point;

/* One border polyline of a tile: `at` rises, along +x or +z, from 0 to the last sample. */
typedef struct terrimp_border {
    const terrimp_border_point *points; /* (required) [point_count] */
    uint32_t point_count;               /* [Limits: 2..samples of the border] */
} terrimp_border;

typedef struct terrimp_simplify_desc {
    const float *heights; /* (required) [rows][cols] of the tile, packed, finite [wu] */
    uint32_t cols;        /* (required) samples along x [Limits: 2..TERRIMP_MAX_TILE_DIM] */
    uint32_t rows;        /* (required) samples along z [Limits: 2..TERRIMP_MAX_TILE_DIM] */
    uint32_t triangle_budget; /* surface triangles at most [Limits: at least the border's own
                                 need, that is border vertices - 2; ..TERRIMP_MAX_TRIANGLES]
                                 [Default 0 -> TERRIMP_TRIANGLE_BUDGET] */
    terrimp_border borders[TERRIMP_SIDE_COUNT]; /* (required) the four polylines; where two
                                                     meet, both have the same height */
} terrimp_simplify_desc;

/* A vertex of a coarse mesh. */
typedef struct terrimp_mesh_vertex {
    uint16_t x, z; /* samples from the tile's sample (0, 0) */
    float height;  /* [wu] */
} terrimp_mesh_vertex;

/* A coarse mesh, in arrays of the caller. Vertices: first the border, as a loop that runs
   counter-clockwise seen from above from (0, 0) along +z; then the interior; then what the skirts
   appended. Triangles wind counter-clockwise seen from above: first the surface, then the lower
   skirt, then the upper one. */
typedef struct terrimp_mesh {
    terrimp_mesh_vertex *vertices;  /* (required) [vertex_capacity] */
    uint16_t *indices;              /* (required) [index_capacity] */
    uint32_t vertex_capacity;       /* (required) terrimp_mesh_capacity says what is enough */
    uint32_t index_capacity;        /* (required) the same, in indices */
    uint32_t border_vertex_count;   /* out: vertices of the loop */
    uint32_t surface_vertex_count;  /* out: vertices of the loop and the interior */
    uint32_t vertex_count;          /* out: all vertices */
    uint32_t surface_index_count;   /* out: indices of the surface */
    uint32_t index_count;           /* out: all indices */
} terrimp_mesh;

/* Simplifies one border of a tile on its own. The result depends on these samples alone, so two
   tiles that share a border get the same bits and their coarse meshes meet without a gap. Points
   are removed one by one (the collapse of Hess fig. 3.2 within a border), then the inner ones are
   moved along the border and given the heights that fit the samples best in the least-squares
   sense. The ends keep their samples: four tiles share a corner.

   heights     [count] samples of the border, along +x or +z, finite [wu]
   count       [Limits: 2..TERRIMP_MAX_TILE_DIM]
   inner_limit inner points to keep at most; 0 -> TERRIMP_BORDER_POINTS. A border of no more
               samples than that many points is kept whole, sample by sample
   points      [capacity] out; capacity of inner_limit + 2 (or count) is always enough
   point_count out: points written
   Cost        O(count^2), no allocation; about 20 us for 65 samples, 3 KB of stack
   Source      Hess 2010, section 3.1, fig. 3.2 */
TERRIMP_API terrimp_result terrimp_border_simplify(const float *heights, uint32_t count,
                                                   uint32_t inner_limit,
                                                   terrimp_border_point *points,
                                                   uint32_t capacity, uint32_t *point_count);

/* Bytes of scratch memory that terrimp_simplify needs for such a desc; 0 when a number is outside
   its limits. */
TERRIMP_API size_t terrimp_simplify_scratch_bytes(uint32_t cols, uint32_t rows,
                                                  uint32_t triangle_budget);

/* Largest numbers of vertices and indices that a coarse mesh of a budget can have, with both of
   its skirts.

   triangle_budget   0 -> TERRIMP_TRIANGLE_BUDGET [Limits: ..TERRIMP_MAX_TRIANGLES]
   vertex_capacity   out
   index_capacity    out */
TERRIMP_API terrimp_result terrimp_mesh_capacity(uint32_t triangle_budget,
                                                 uint32_t *vertex_capacity,
                                                 uint32_t *index_capacity);

/* Simplifies a tile of terrain to a coarse mesh of a fixed triangle budget between four border
   polylines. A tile whose samples all fit the budget is returned whole; ground that is met without
   error may take fewer triangles, and one triangle stays over where the count does not work out.
   The mesh covers the tile's rectangle one to one: no triangle has a normal with y <= 0,
   which is tested in integers. Two triangles share each inner edge, vertices stand on samples.

   desc           what to simplify
   scratch        [scratch_bytes] aligned for int64_t; contents need not outlive the call
   scratch_bytes  at least terrimp_simplify_scratch_bytes(desc->cols, desc->rows, budget)
   mesh           in: arrays and capacities; out: everything else
   Errors         E_RANGE also for a budget that is too small for the borders, border positions that
                  do not rise from 0 to the end, corners that disagree
   Cost           O(cols rows + budget^2); about 0.65 ms for 65 x 65 at the default budget
   Source         Hess 2010, section 3.1; the fit of heights after Lindstrom and Turk's idea that
                  a moved vertex beats a chosen one, here along y alone */
TERRIMP_API terrimp_result terrimp_simplify(const terrimp_simplify_desc *desc, void *scratch,
                                            size_t scratch_bytes, terrimp_mesh *mesh);

/* The bytes of scratch that terrimp_simplify_field wants; 0 when a number is outside its limits. */
TERRIMP_API size_t terrimp_simplify_field_scratch_bytes(uint32_t cols, uint32_t rows,
                                                        uint32_t triangle_budget);

/* Simplifies a rectangle of a heightfield in one call. Its borders are simplified on their own, to
   as many points as the budget asks for, so that two of them side by side meet.

   samples          inside the field [Limits: width, height 2..TERRIMP_MAX_TILE_DIM]
   triangle_budget  [Limits: 6..TERRIMP_MAX_TRIANGLES] [Default 0 -> TERRIMP_TRIANGLE_BUDGET]
   max_error        [wu] above 0: as few triangles as are found to keep every sample within it; all
                    of the budget when that is not enough [Limits: >= 0]
   scratch          [bytes] aligned to 8 bytes
   mesh             in: arrays, as terrimp_mesh_capacity says; out: in samples of the rectangle
   error            out: [wu] the largest vertical distance of a sample; NULL: not wanted
   Errors           E_VOID for a sample without data
   Cost             that of terrimp_simplify; with max_error some ten times as much */
TERRIMP_API terrimp_result terrimp_simplify_field(const terrimp_heightfield *field,
                                                  const terrimp_rect *samples,
                                                  uint32_t triangle_budget, float max_error,
                                                  void *scratch, size_t bytes, terrimp_mesh *mesh,
                                                  float *error);

/* --- skirts (Hess 4.2) --- */

/* Appends a skirt: a wall along the border, of as many vertices as its loop and two triangles for
   each of them. The lower one fills the gap to a neighbour of another level and faces outwards; the
   upper one catches those pixels of a picture that lie above a border that is too low, and faces
   inwards: keep it small.

   mesh    in: a surface, perhaps with skirts; out: the same and the wall
   upper   0: the lower skirt
   height  [wu] of the lower skirt, its bottom, as a rule the node's least height; a border vertex
           that lies lower gets a wall of no height. Of the upper one, its rise [Limits: >= 0]
   Errors  E_STATE when the mesh has no surface yet
   Source  Hess 2010, section 4.2 */
TERRIMP_API terrimp_result terrimp_mesh_add_skirt(terrimp_mesh *mesh, int upper, float height);

/* ==== Builder ============================================================ >>builder */

/* --- voids --- */

/* The bytes of scratch that fill_voids wants: 5/3 a sample, and a few rows.

   width, depth  of the field [Limits: 2..TERRIMP_MAX_DIM]
   Returns       0 for sizes outside the limits or beyond size_t */
TERRIMP_API size_t terrimp_heightfield_fill_voids_scratch_bytes(uint32_t width, uint32_t depth);

/* Fills every void in place, as smoothly as a membrane stretched over its rim (an approximate
   solution of Laplace's equation). Each filled sample lies between the lowest and the highest valid
   one, valid samples keep their value, and the edges of the field pull at nothing.

   samples         the same address as field->samples, writable
   scratch         aligned for float; NULL is E_NULL even if there is no void
   scratch_bytes   at least terrimp_heightfield_fill_voids_scratch_bytes(width, depth)
   filled_count    receives the number of filled samples, 0 without has_no_data; NULL: not wanted
   Errors          E_RANGE also when samples is not field->samples; E_VOID when no sample is valid;
                   E_NOT_FINITE for such a height. No sample changes then
   Cost            O(width * depth); some 0.35 s for 3601 x 3601 samples of which half are void
   Source          Bornemann and Deuflhard 1996, The cascadic multigrid method: from coarse to fine,
                   with more relaxation the coarser the grid */
TERRIMP_API terrimp_result terrimp_heightfield_fill_voids(const terrimp_heightfield *field,
                                                          void *samples, void *scratch,
                                                          size_t scratch_bytes,
                                                          size_t *filled_count);

/* --- heights and errors of the ground --- */

/* Finds heights, error and rms of all nodes; parents hold what their children hold.

   scratch    [field.width + 2 * chunk_quads + 2]
   Errors     E_VOID, E_NOT_FINITE for such a sample
   Cost       O(samples * levels); about 2.5 s for 4097 x 4097 samples in chunks of 64 */
TERRIMP_API terrimp_result terrimp_geomip_build(const terrimp_quadtree *tree, float *scratch);

/* --- terrain --- */

/* Bytes of the block that a terrain lives in, and of the scratch block that building it needs.
   0 when the descriptor is wrong or the size overflows. Both blocks are aligned to 8 bytes. */
TERRIMP_API size_t terrimp_terrain_bytes(const terrimp_terrain_desc *desc);
TERRIMP_API size_t terrimp_terrain_scratch_bytes(const terrimp_terrain_desc *desc);

/* Lays a terrain out in the caller's block. No sample is read, nothing is built yet.

   memory     [bytes] aligned to 8 bytes; freed by the caller when the terrain is no longer used
   terrain    out: lies in memory */
TERRIMP_API terrimp_result terrimp_terrain_init(const terrimp_terrain_desc *desc, void *memory,
                                                size_t bytes, terrimp_terrain **terrain);

/* Begins the building: settles the range that the heights of all meshes are stored in, so that they
   can be built in any order and still meet. Looks at every sample, unless the descriptor names the
   range. To be called once, before any node is built.

   Errors     E_VOID, E_NOT_FINITE for such a sample; E_RANGE when the range overflows, or the sum
              of its squares over all samples
   Cost       O(width * depth), about 1.5 ns a sample; O(1) when the range is named */
TERRIMP_API terrimp_result terrimp_terrain_build_begin(terrimp_terrain *terrain);

/* Builds one node of any level: heights, the errors of its ground, its coarse mesh and the errors
   of that against every sample. Nodes may be built in any order, and at the same time from
   different threads with scratch blocks of their own: the result is the same, bit for bit.

   node       [Limits: < node_count]
   scratch    [bytes] at least terrimp_terrain_scratch_bytes
   Errors     E_RANGE, also for a sample outside of the named range; E_VOID, E_NOT_FINITE for such a
              sample
   Cost       1.4 ms for 64 x 64 quads at level 0; at every level that, and the visits to all of the
              node's samples, 25 ns for each
   Source     Hess 2010, section 6.5, asks for meshes of several chunks */
TERRIMP_API terrimp_result terrimp_terrain_build_node(terrimp_terrain *terrain, uint32_t node,
                                                      void *scratch, size_t bytes);

/* Ends the building: boxes and errors of parents hold those of their children. Errors: E_STATE when
   a node has not been built. */
TERRIMP_API terrimp_result terrimp_terrain_build_finish(terrimp_terrain *terrain);

/* Begins, builds all nodes, one after the other, and finishes. Errors: those of the three above. */
TERRIMP_API terrimp_result terrimp_terrain_build(terrimp_terrain *terrain, void *scratch,
                                                 size_t bytes);

/* Takes note of samples that the host has changed, so that all can be drawn at once: boxes and
   errors of the nodes of all levels that they belong to hold for the new ones, too, but may be
   larger than need be; and views draw these nodes as ground, which is the new one. The rest is left
   to terrimp_terrain_refine. Call terrimp_view_touch for each view, fill the ground of the nodes of
   terrimp_terrain_touched anew. No view may update meanwhile. Name the range of heights in the
   descriptor, so that it does not hang on what the samples once were.

   samples    the changed ones: columns from x on, rows from y on [Limits: width, height >= 1, and
              it begins inside the field]; what reaches over the last column and row is cut
   Errors     E_RANGE for a rectangle outside of the limits or a height outside of the range;
              E_VOID, E_NOT_FINITE for such a sample; E_STATE before build_finish and for a terrain
              that uses a bake. Nothing has changed then
   Cost       of 16 x 16 samples 0.1 ms in a terrain of 1025 x 1025, 1.5 ms in one of 8193 x 8193 */
TERRIMP_API terrimp_result terrimp_terrain_edit(terrimp_terrain *terrain,
                                                const terrimp_rect *samples);

/* Builds some of the nodes anew that edits have left, from the finest level up; between frames.
   When none is left all is as if everything had been built anew, bit for bit, with the same range.

   nodes      [count] out: which ones; their coarse meshes are to be filled anew. NULL: not wanted
   count      how many at most
   done       out: how many; less than count when none is left
   scratch    [bytes] at least terrimp_terrain_scratch_bytes
   Cost       that of build_node for each: the root has every sample, and comes last */
TERRIMP_API terrimp_result terrimp_terrain_refine(terrimp_terrain *terrain, uint32_t *nodes,
                                                  uint32_t count, uint32_t *done, void *scratch,
                                                  size_t bytes);

/* Both in one: nothing is left then. */
TERRIMP_API terrimp_result terrimp_terrain_rebuild(terrimp_terrain *terrain,
                                                   const terrimp_rect *samples, void *scratch,
                                                   size_t bytes);

#ifndef TERRIMP_NO_MALLOC

/* Allocates, lays out and builds a terrain in one call.

   allocator    NULL: TERRIMP_MALLOC and TERRIMP_FREE
   Errors       those of init and build; E_MEMORY when there is none */
TERRIMP_API terrimp_result terrimp_terrain_create(const terrimp_terrain_desc *desc,
                                                  const terrimp_allocator *allocator,
                                                  terrimp_terrain **terrain);

#endif /* TERRIMP_NO_MALLOC */

/* --- materials --- */

/* Where a material lies: weights over the whole terrain, as a texture that is clamped at its edges
   and read bilinearly. */
typedef struct terrimp_weights {
    const uint8_t *texels; /* (required) */
    uint32_t width, depth; /* in texels [Limits: 1..65536] */
    size_t texel_bytes;    /* from one to the next [Default 0 -> 1] */
    size_t row_bytes;      /* from row to row [Default 0 -> width * texel_bytes] */
    int centred;           /* nonzero: the middles of the first and the last texel lie on the first
                              and the last sample; else their outer edges do */
} terrimp_weights;

/* Finds which materials lie on each node: bit k of masks[node] for weights k. A pass that lacks its
   bit has no weight on any pixel of the node and need not be drawn: every command says its node, on
   the screen and in captures.

   weights    [count]
   count      [Limits: 1..32]
   reach      [texels] of a read to both sides: 1 when it is bilinear; with mipmaps up to level m
              1.5 times 2^m, so let the texture have no more of them [Limits: 1..65536]
   masks      [node_count] out
   Cost       O(count * texels)
   Source     Wagner 2003, "Materials" */
TERRIMP_API terrimp_result terrimp_material_masks(const terrimp_quadtree *tree,
                                                  const terrimp_weights *weights, uint32_t count,
                                                  float reach, uint32_t *masks);

/* --- bake --- */

/* The bytes of a terrain's bake; 0 when the terrain is NULL or not built, or for 4 GiB and more. */
TERRIMP_API size_t terrimp_bake_bytes(const terrimp_terrain *terrain);

/* Writes the bake of a terrain. The same terrain gives the same bytes.

   out        [bytes] aligned to 8 bytes
   bytes      at least terrimp_bake_bytes
   swapped    nonzero: for a machine of the other byte order
   Errors     E_STATE also while terrimp_terrain_refine has nodes left to build
   Cost       O(nodes + samples): a checksum of all samples is taken */
TERRIMP_API terrimp_result terrimp_bake_write(const terrimp_terrain *terrain, void *out,
                                              size_t bytes, int swapped);

/* ==== Page builder ======================================================= >>page-builder */

/* Makes the pages of the room Residency from samples that are larger than memory. The terrain is
   built block by block, each in memory of its own, in any order, by any number of threads or
   processes, to the same bytes; and the levels above the blocks, and the header, at last. What has
   been written once need not be done again. Blocks stand one behind the other: those of a range
   are one piece of the file.

   In a block, and in a terrain of one block, all is what building in memory makes of it. Above the
   blocks, ground and meshes are made of every 2^block_level-th sample, and their errors are those
   against these, and what the blocks miss added: those of ground are no less than of memory. */
typedef struct terrimp_pages_desc {
    terrimp_terrain_desc terrain; /* (required) but its samples, which are without voids;
                                     height_low and height_high have to be given */
    uint32_t block_level;         /* blocks are the nodes of this level
                                     [Default 0 -> 4; all for up to 4097 x 4097 samples] */
    float morph_ratio;            /* of views, at most; more makes ground finer, also where it does
                                     not morph. Above 1, chunks are of a multiple of 4 quads
                                     [Limits: 1..4] [Default 0 -> 1] */
    uint32_t stamp;               /* any number: it and the settings make the stamp of the pages */
    void *user;                   /* the first argument of each of these; they return 0 for "no" */
    int (*read)(void *user, uint32_t x, uint32_t z, uint32_t cols, uint32_t rows, void *samples,
                size_t row_bytes); /* (required) fills [rows][cols] samples from (x, z) on */
    int (*load)(void *user, uint64_t offset, void *bytes, size_t count);        /* (required) ... */
    int (*store)(void *user, uint64_t offset, const void *bytes, size_t count); /* of the file */
} terrimp_pages_desc;

/* Writes the effective descriptor, and how many blocks it makes. */
TERRIMP_API terrimp_result terrimp_pages_desc_resolve(const terrimp_pages_desc *desc,
                                                      terrimp_pages_desc *out,
                                                      uint32_t *block_count);

/* The part of the file that some blocks are: [offset, offset + bytes). Errors: E_RANGE when they
   are not all there. */
TERRIMP_API terrimp_result terrimp_pages_place(const terrimp_pages_desc *desc, uint32_t first_block,
                                               uint32_t block_count, uint64_t *offset,
                                               uint64_t *bytes);

/* Bytes of scratch for one block, or for the end. 0 when the descriptor is wrong. 13 MiB for blocks
   of level 4 in chunks of 64; for the end 520 bytes a block, and 2 for each of its samples. */
TERRIMP_API size_t terrimp_pages_scratch_bytes(const terrimp_pages_desc *desc);

/* Builds one block: reads it and 2^block_level samples round it, stores its pages, the topmost as
   the last one.

   scratch    [bytes] at least terrimp_pages_scratch_bytes, aligned to 8 bytes; not shared
   Errors     E_PAGE when read or store says no; E_VOID; E_RANGE for a height outside of the range
   Cost       that of terrimp_terrain_build_node for each of its nodes */
TERRIMP_API terrimp_result terrimp_pages_build_block(const terrimp_pages_desc *desc, uint32_t block,
                                                     void *scratch, size_t bytes);

/* Whether a block has been built: looks at its topmost page. Errors: E_PAGE when load says no;
   E_BAKE when it is damaged, or of other settings. */
TERRIMP_API terrimp_result terrimp_pages_check_block(const terrimp_pages_desc *desc,
                                                     uint32_t block, void *scratch, size_t bytes);

/* Builds the levels above the blocks, then the header, from the blocks. Errors: E_PAGE when a
   callback says no; E_BAKE for a damaged page. */
TERRIMP_API terrimp_result terrimp_pages_build_end(const terrimp_pages_desc *desc, void *scratch,
                                                   size_t bytes);

/* ==== Visible sets ======================================================= >>visible-sets */

/* --- walls: what a horizon is made of --- */

/* Finds the walls of one node, from the samples at level 0, else from its children's: those have to
   be built before. Different nodes of a level may be built at the same time by several threads.

   walls      [terrimp_walls_bytes] out: the part of this node; aligned to 4
   Cost       about 20 us at level 0 with chunks of 64 quads, 3 us above */
TERRIMP_API terrimp_result terrimp_walls_build_node(const terrimp_quadtree *tree, uint32_t node,
                                                    void *walls);

/* Finds those of all nodes that a rectangle of samples belongs to, after an edit or at first.

   samples    NULL: all
   Errors     E_RANGE also for a rectangle that is empty or outside
   Cost       that of build_node for each: 0.05 ms for a chunk and all nodes above it */
TERRIMP_API terrimp_result terrimp_walls_build(const terrimp_quadtree *tree,
                                               const terrimp_rect *samples, void *walls);

/* --- visible sets --- */

/* Finds the codes of one cell, after terrimp_sets_init. Different cells may be built at the same
   time by several threads.

   sets       its codes of this cell are written
   walls      [terrimp_walls_bytes] built
   cell       [Limits: < nodes of cell_level]
   samples    after an edit: only the nodes are found anew whose sight lines meet it; NULL: all
   Cost       10 ms for 256 nodes of 64 x 64 quads, 4 ms for those of 16 x 16
   Source     Wagner 2003 asks for them; monotony in height, cuts and their proof are our own */
TERRIMP_API terrimp_result terrimp_sets_build_cell(const terrimp_sets *sets, const void *walls,
                                                   uint32_t cell, const terrimp_rect *samples);

/* Forgets what an edit may have changed, in the frame of the edit: those nodes are not hidden any
   more. Building its cells anew, at leisure, with the same rectangle, finds them again.

   Cost       20 ns for a cell and a node */
TERRIMP_API terrimp_result terrimp_sets_touch(const terrimp_sets *sets,
                                              const terrimp_rect *samples);

/* ==== Layer builder ====================================================== >>layer-builder */

/* From where layers are to be seen, and what they show. The cell is a box, or a shaft that opens
   away from the scenery; the reference point is the middle of its side that faces the scenery. */
typedef struct terrimp_layers_desc {
    float distance;      /* (required) [wu] from that side to the scenery [Limits: > 0] */
    float depth;         /* [wu] of the scenery [Limits: >= 0, may be infinite] */
    float cell_size[2];  /* [wu] width and height of that side [Limits: >= 0] */
    float cell_depth;    /* [wu] of the cell [Limits: >= 0, may be infinite] */
    float cell_tan[2];   /* by how much half its width and half its height grow on the way back: 0
                            for a box [Limits: >= 0] */
    float view_tan[2];   /* (required) largest offset of the scenery from the middle of the picture,
                            to the side and up or down, as a tangent [Limits: > 0] */
    float texel;         /* (required) tangent of a texel. 1 / K of the sharpest view, or less: then
                            no eye of the cell sees a texel larger than a pixel [Limits: > 0] */
    float tolerance_rad; /* largest angle between where a point is and where it appears
                            [Limits: >= 0] [Default 0 -> texel] */
    int even;            /* nonzero: all steps of 1 / depth are alike, so that planes stay planes in
                            the grid of a depth mesh. Takes more layers for shafts, and for scenery
                            wider than the cell */
} terrimp_layers_desc;

/* Places the layers. No line of sight from the cell passes a layer more than one texel, in either
   direction, beside where it passes the next: so texels uncover at most what is right behind them.

   layers     out. Its count is the answer for those that only want to know the price
   Errors     E_RANGE also when more than 65535 layers were needed, as for scenery without end
              that is seen from a cell without end
   Cost       O(log(count)), no list is made
   Source     Jeschke 2004, equations 3.1 to 3.7, derived anew: implementation */
TERRIMP_API terrimp_result terrimp_layers_plan(const terrimp_layers_desc *desc,
                                               terrimp_layers *layers);

/* --- hidden texels (Jeschke 3.4) --- */

/* The opaque texels of a layer, in bits: bit x % 32 of word [y][x / 32] for texel (x, y), rows of
   TERRIMP_MASK_WORDS(width) words. Bits beyond the width may be anything. */
#define TERRIMP_MASK_WORDS(width) (((width) + 31u) / 32u)

typedef enum terrimp_cull_rule {
    TERRIMP_CULL_DEFAULT = 0, /* same as CORNERS */
    TERRIMP_CULL_BLOCK,       /* hidden behind 3 x 3 texels: one mask of state */
    TERRIMP_CULL_CORNERS,     /* hidden from each quarter of the cell behind 2 x 2 texels, which may
                                 be others each time: finds more, four masks of state */
    TERRIMP_CULL_COUNT
} terrimp_cull_rule;

/* Finds the texels of a layer that no eye of the cell can see, for the closer layers hide them.
   Called for one layer after the other, the closest first; all of one size. What is hidden hides
   what is behind it in turn. Never culls what can be seen, if the layers stand as planned, or
   closer together.

   opaque     [height][TERRIMP_MASK_WORDS(width)]
   rule       terrimp_cull_rule
   state      [1 or 4][height][TERRIMP_MASK_WORDS(width)] in and out; 0 before the first layer
   visible    [height][TERRIMP_MASK_WORDS(width)] out: those opaque texels that can be seen; may be
              opaque itself
   Cost       O(width * height / 32): 0.05 ms for 512 x 512
   Source     Jeschke 2004, sections 3.4 and 3.4.1 */
TERRIMP_API terrimp_result terrimp_layer_cull(const uint32_t *opaque, uint32_t width,
                                              uint32_t height, int rule, uint32_t *state,
                                              uint32_t *visible);

/* --- rectangles that hold all opaque texels (Jeschke 3.5) --- */

typedef struct terrimp_cover_desc {
    const uint32_t *mask; /* (required) [height][TERRIMP_MASK_WORDS(width)] opaque texels */
    uint32_t width;       /* (required) [texels] [Limits: 1..16384] */
    uint32_t height;      /* (required) [texels] [Limits: 1..16384] */
    uint32_t quad_cost;   /* what a rectangle costs, in texels: 20 for 80 bytes of vertices, if a
                             texel has 4 [Limits: 1..2^24] [Default 0 -> 20] */
    uint32_t gutter;      /* texels round each rectangle that count as its own [Limits: 0..64] */
} terrimp_cover_desc;

/* Bytes of scratch memory that terrimp_cover needs; 0 when the numbers of the descriptor are out of
   their limits or capacity is 0. */
TERRIMP_API size_t terrimp_cover_scratch_bytes(const terrimp_cover_desc *desc, uint32_t capacity);

/* Covers all opaque texels with rectangles that do not overlap, so that texels + quad_cost *
   rectangles becomes small: cuts in two where little is left, until no cut can pay; takes back the
   cuts that did not pay; then joins rectangles where that does.

   scratch    aligned to 8 bytes
   rects      [capacity] out, without gutter
   count      out: how many there are; none for an empty mask
   Cost       about O(width * height / 32 * log(count)) */
TERRIMP_API terrimp_result terrimp_cover(const terrimp_cover_desc *desc, void *scratch,
                                         size_t bytes, terrimp_rect *rects, uint32_t capacity,
                                         uint32_t *count);

/* Places the quads of one or more layers in an atlas, each with a gutter round it that the host
   fills with copies of its outermost texels. Never scales.

   atlas       [2] [texels] its width and height [Limits: 1..65536]
   quads       [count] in: texels; out: x and y
   gutter      [texels] [Limits: 0..64]
   rects       [count] out: the places, gutters included
   order       [2 * count] scratch
   Errors      E_CAPACITY when not all fit: quads are unchanged
   Cost        that of terrimp_pack_ffdh
   Source      Jeschke 2004, section 3.6, without his powers of two */
TERRIMP_API terrimp_result terrimp_layer_pack(const uint32_t atlas[2], terrimp_layer_quad *quads,
                                              uint32_t count, uint32_t gutter,
                                              terrimp_rect *rects, uint32_t *order);

/* --- recording without gaps (Jeschke 3.3.2) --- */

/* Cuts what lies between two depths out of a triangle, for hosts that draw layers by hardware: they
   then draw it with its outline, each line in one direction, for instance from left to right. Cuts
   of an edge depend on its two ends alone, not on their order: so the two layers that meet in a cut
   get the same bits, and so do two triangles that share an edge.

   vertices   [3][stride] any numbers that change linearly over the triangle
   stride     [Limits: >= 1]
   depths     [3] of the vertices [wu], finite
   low, high  [wu] borders of the layer [Limits: low <= high]
   out        [5][stride] the polygon, with the triangle's winding; not vertices
   count      out: of its vertices; 0 when nothing is between */
TERRIMP_API terrimp_result terrimp_layer_clip(const float *vertices, uint32_t stride,
                                              const float depths[3], float low, float high,
                                              float *out, uint32_t *count);

/* Masks of all layers that are recorded together: [layers->count][height][words of width]. */
typedef struct terrimp_layer_record {
    const terrimp_layers *layers;    /* (required) */
    const terrimp_capture *picture;  /* (required) as in terrimp_layer_corners */
    uint32_t width, height;          /* (required) of the picture [texels] [Limits: 1..16384] */
    uint32_t *masks;                 /* (required) begins as 0 */
    int no_outline;                  /* nonzero: only texels whose centre is covered, for leaves and
                                        the like: they are not fattened, and their gaps hide */
} terrimp_layer_record;

/* Sets in each layer the texels that a triangle touches between the layer's borders. What touches a
   border is in both layers; what lies outside of the picture or of all layers is left out.

   xyz        [3][3] [wu]
   Cost       O(rows that are touched, in all layers) */
TERRIMP_API terrimp_result terrimp_layer_triangle(const terrimp_layer_record *record,
                                                  const float xyz[9]);

/* The same for a picture with depth, such as one of a heightfield: each texel is in all layers that
   its depths touch, from the least to the greatest at its corners. Neighbours share two corners: so
   there is no gap between layers, and nothing is to be clipped.

   depths     [height + 1][width + 1] of the corners of texels, row 0 the lowest [wu]; <= 0, NaN or
              infinite where there is nothing. Texels without any depth stay empty
   Cost       O(width * height * log(count)) */
TERRIMP_API terrimp_result terrimp_layer_depths(const terrimp_layer_record *record,
                                                const float *depths);

/* Closes what hardware leaves open between two layers: its lines go over corners. Where a block of
   2 x 2 texels has one diagonal in both layers, and of the other one each texel in one layer only,
   the one of the closer layer is wanted in the other as well.

   front, back   [height][TERRIMP_MASK_WORDS(width)] layer k and layer k + 1
   wanted        [height][TERRIMP_MASK_WORDS(width)] out: texels whose colours are to be copied from
                 front to back; neither of the two
   Cost          O(width * height / 32) */
TERRIMP_API terrimp_result terrimp_layer_repair(const uint32_t *front, const uint32_t *back,
                                                uint32_t width, uint32_t height,
                                                uint32_t *wanted);

/* --- textured depth meshes (Jeschke 4) --- */

/* A part of a depth mesh that shows each texel once, and so has one texture: its rectangle of the
   picture, where each texel has the colour of one of the layers. */
typedef struct terrimp_depth_sheet {
    terrimp_rect texels;
    uint32_t first_texel;              /* of its rectangle, row by row, in texel_layers */
    uint32_t first_index, index_count; /* its triangles */
} terrimp_depth_sheet;

#define TERRIMP_DEPTH_NONE 0xffffu /* a texel that no layer has a colour for */

typedef struct terrimp_depth_mesh_desc {
    const uint32_t *opaque;  /* (required) [layers][height][TERRIMP_MASK_WORDS(width)] all texels:
                                where layers touch in these, the mesh is connected */
    const uint32_t *visible; /* (required) the same, culled: what must be shown; may be opaque */
    uint32_t width;        /* (required) [texels] [Limits: 1..16384] */
    uint32_t height;       /* (required) [texels] [Limits: 1..16384] */
    uint32_t layers;       /* (required) [Limits: 1..65535] */
    float tolerance;       /* [texels, layers] from the middle of each opaque texel to the mesh, and
                              in each direction from the mesh to such a middle, looked at in steps
                              of up to 1
                              [Limits: 0.75..64] [Default 0 -> 1] */
} terrimp_depth_mesh_desc;

/* A depth mesh in arrays of the caller. */
typedef struct terrimp_depth_mesh {
    terrimp_depth_vertex *vertices; /* (required) [vertex_capacity] */
    uint32_t *indices;              /* (required) [index_capacity] they wind counter-clockwise */
    terrimp_depth_sheet *sheets;    /* (required) [sheet_capacity] */
    uint16_t *texel_layers;         /* (required) [texel_capacity] or TERRIMP_DEPTH_NONE */
    uint32_t vertex_capacity, index_capacity, sheet_capacity, texel_capacity;
    uint32_t vertex_count, index_count, sheet_count, texel_count; /* out, also when too many */
    uint32_t first_triangle_count;  /* out: before any was saved */
} terrimp_depth_mesh;

/* Bytes of scratch memory for a depth mesh of these masks; 0 for bad ones, or when they overflow.
   Looks at all of them. */
TERRIMP_API size_t terrimp_depth_mesh_scratch_bytes(const terrimp_depth_mesh_desc *desc);

/* Makes one mesh of all layers: as many triangles as the shape needs, however many layers that
   reaches through. Texels are connected where layers touch; then edges collapse, short ones first,
   as long as the mesh stays within the tolerance of the texels and they of it. Its border and the
   seams between sheets only move along themselves, a border by a texel at most. Where sheets fold
   slivers are lost: of lines of sight that meet the layers of sheets of random waves 22 of 311,536
   (in the worst of 40 scenes one of 900), of walls, boxes and slopes none. The texture needs no
   perspective: it is the picture, as terrimp_texture_matrix projects it. Texels at a sheet's border
   may be wanted that have no colour: hosts fill them from their neighbours, as gutters.

   scratch    aligned to 8 bytes
   mesh       in: arrays; out: the rest
   Errors     E_CAPACITY: counts say how much is needed
   Cost       about 3 us for each visible texel; 0.17 s for 58,000 in 113 layers
   Source     Jeschke 2004, chapter 4. Ours: one vertex for each corner of texels where he has four
              for each texel; the bound from mesh to layers; sheets */
TERRIMP_API terrimp_result terrimp_depth_mesh_make(const terrimp_depth_mesh_desc *desc,
                                                   void *scratch, size_t bytes,
                                                   terrimp_depth_mesh *mesh);

/* --- layers all round a cell, and for all views of an object (Jeschke 3.8) --- */

/* Layers for everything beyond a distance from a cube: the same ones before each of its six sides,
   each from the middle of its side. A side's picture holds its sixth of the world, the pyramid
   from the cube's centre, and some of its neighbours', since it is taken from closer by.

   centre     [3] of the cube [wu]
   desc       distance, depth, texel, tolerance_rad and even; distance counts from the sides. Its
              cell_size, cell_depth, cell_tan and view_tan are not looked at
   half       [wu] of the cube's side [Limits: > 0]
   layers     out
   pictures   [6] out: +x, -x, +y, -y, +z, -z */
TERRIMP_API terrimp_result terrimp_layers_around(const terrimp_layers_desc *desc,
                                                 const float centre[3], float half,
                                                 terrimp_layers *layers,
                                                 terrimp_capture pictures[6]);

/* Layers for an object that is seen from everywhere: three sets, across x, y and z, recorded in
   parallel projection. An eye draws the set across the direction that it looks along most, from
   either side. Layer i of `count` stands at box->min + (i + 0.5) / count of the extent.

   texel      [wu] of all layers; for an eye at a distance d no more than d / K [Limits: > 0]
   slope      largest tangent between a line of sight and the axis of the set that is drawn: 1 for
              eyes far away, 1 + extent / distance for closer ones [Limits: >= 1]
   counts     [3] out: layers across x, y, z. Texels pass each other by one at most
   Errors     E_RANGE also when more than 65535 layers were needed */
TERRIMP_API terrimp_result terrimp_layers_object(const terrimp_box *box, float texel, float slope,
                                                 uint32_t counts[3]);

/* ==== Placement ========================================================== >>placement */

/* Which pictures to prepare, so that no view costs more than a budget and the pictures take little
   memory. Views stand for all eyes of a cell that look into a range of directions: what a view
   costs is what the frustum holds that encloses all of theirs. Clusters are what a picture can show
   in place of geometry: the nodes of a hierarchy. Candidates are pictures that might be made: of a
   cluster, for some cells. */

/* What a candidate does for a view. */
typedef struct terrimp_place_gain {
    uint32_t view;
    float saved;  /* cost of the cluster as geometry, less that of its picture [Limits: finite] */
} terrimp_place_gain;

typedef struct terrimp_place_candidate {
    uint32_t cluster;
    uint32_t first_gain, gain_count; /* its gains, which are no other's; one a view at most */
    float memory;                    /* of the picture, in any unit [Limits: > 0] */
} terrimp_place_candidate;

typedef struct terrimp_place_desc {
    const terrimp_place_candidate *candidates; /* (required) [candidate_count] */
    const terrimp_place_gain *gains;           /* (required) [gain_count] */
    const uint32_t *parents;                   /* (required) [cluster_count] the cluster that holds
                                                  it, with a greater number; its own for a root */
    const float *costs;                        /* (required) [view_count] without pictures
                                                  [Limits: finite] */
    uint32_t candidate_count, gain_count, cluster_count, view_count;
    float budget;                              /* (required) of each view [Limits: finite] */
} terrimp_place_desc;

typedef struct terrimp_placement {
    uint32_t chosen;   /* candidates */
    uint32_t problems; /* views that cost more than the budget without pictures */
    uint32_t unsolved; /* those that still do: make their cells smaller, or give more candidates */
    float memory;      /* of the chosen ones */
} terrimp_placement;

/* Bytes of scratch memory that terrimp_place needs; 0 for NULL or when they overflow. */
TERRIMP_API size_t terrimp_place_scratch_bytes(const terrimp_place_desc *desc);

/* Chooses candidates: again and again the one that takes most off what views cost above the budget,
   for its memory; a picture of a cluster takes the place of pictures of the same and of what is in
   it. Then those are given back that others can stand in for. Small sets are gone through again and
   again, with one or two candidates more or less, while that pays. Costs count as within the budget
   to 1e-5 of it.

   scratch    aligned to 8 bytes
   shown      [gain_count] out: 1 where the candidate's picture is shown in that view, else 0. A
              candidate is to be made if it is shown in any
   costs      [view_count] out: what views cost then
   placement  out
   Errors     E_RANGE also for a parent that is not greater, or a gain of two candidates
   Cost       about O(gains + chosen * log(candidates)): scores only ever fall, so that only the
              best one is scored anew until it stays the best. 0.8 s for 300,000 candidates with
              3.1 million gains, 27 bytes of scratch memory for each of these
   Source     Jeschke 2004, section 5.7; all after the choice is ours */
TERRIMP_API terrimp_result terrimp_place(const terrimp_place_desc *desc, void *scratch,
                                         size_t bytes, uint8_t *shown, float *costs,
                                         terrimp_placement *placement);

/* --- a prepared set for a terrain --- */

/* Eyes are anywhere in a box, which is cut along x and z into 2^cell_levels x 2^cell_levels cells;
   they look level, or up and down as far as the same nodes are in sight. Costs are those of draws
   and triangles of ground, at the level that keeps the tolerance, and of coarse meshes. */
typedef struct terrimp_place_terrain_desc {
    const terrimp_terrain *terrain; /* (required) built */
    terrimp_box eyes;        /* (required) [wu] */
    uint32_t cell_levels;    /* [Limits: 0..6] */
    uint32_t directions;     /* parts of the circle, each with its views [Limits: 1..64]
                                [Default 0 -> 8] */
    float fov_rad;           /* (required) width of what an eye sees, seen from above
                                [Limits: 0.01..6.3] */
    float pixel_factor;      /* (required) K [Limits: > 0] */
    float tolerance_px;      /* of ground and of pictures [Limits: > 0] [Default 0 -> 1] */
    float max_angle_rad;     /* by which a picture's node may turn over its cells [Limits: > 0]
                                [Default 0 -> 0.1] */
    float texels_per_px;     /* from the closest eye [Limits: > 0] [Default 0 -> 1] */
    float draw_cost, triangle_cost; /* [Limits: >= 0] [Default both 0 -> 40 and 1] */
    int shafts;                     /* nonzero: a picture serves every cell behind its square, too,
                                       that keeps within tolerance and angle: together a shaft
                                       that opens away from the node */
} terrimp_place_terrain_desc;

/* A picture that may be prepared: of a node, for a square of cells, from its middle; with shafts
   for cells behind that, too. */
typedef struct terrimp_place_picture {
    uint32_t node;
    uint32_t level;         /* 2^level x 2^level cells */
    uint32_t x, z;          /* squares of that size from the corner of the eyes' box */
    float eye[3];           /* [wu] terrimp_capture_fit of the node's box from here */
    uint32_t width, height; /* [texels] without margins */
} terrimp_place_picture;

/* Arrays of the caller; counts are written also when they are more than the capacities. View
   (z * cells + x) * directions + k looks from cell (x, z) into the k-th part of the circle, from +x
   towards +z. Candidates' memory counts texels. */
typedef struct terrimp_place_set {
    terrimp_place_candidate *candidates; /* [candidate_capacity] out */
    terrimp_place_picture *pictures;     /* [candidate_capacity] out, the same in other words */
    terrimp_place_gain *gains;           /* [gain_capacity] out */
    uint32_t *parents;                   /* [cluster_capacity] out: one a node */
    float *costs;                        /* [view_capacity] out */
    uint32_t candidate_capacity, gain_capacity, cluster_capacity, view_capacity;
    uint32_t candidate_count, gain_count, cluster_count, view_count; /* out */
} terrimp_place_set;

/* Bytes of scratch memory that terrimp_place_terrain needs; 0 for a descriptor that it refuses. */
TERRIMP_API size_t terrimp_place_terrain_scratch_bytes(const terrimp_place_terrain_desc *desc);

/* Makes the input of terrimp_place from a terrain: every node, for every square of cells from which
   its picture would keep within the tolerance and the angle, wherever it saves something. What is
   chosen then is rendered once, by the captures that are always used, and drawn from read-only
   memory: for machines that cannot render into textures.

   scratch    aligned to 8 bytes
   Errors     E_CAPACITY: the counts say how much is needed
   Cost       O(views * nodes * cell_levels); with shafts O(views * nodes * cells), 0.4 s for 64
              cells, 12 directions and 341 nodes
   Source     Jeschke 2004, sections 5.5 and 5.6 */
TERRIMP_API terrimp_result terrimp_place_terrain(const terrimp_place_terrain_desc *desc,
                                                 void *scratch, size_t bytes,
                                                 terrimp_place_set *set);

#endif /* TERRIMP_NO_BUILD */

#ifdef __cplusplus
}
#endif

#endif /* TERRIMP_H */

/* ==== stop here if you only want the API ================================= */

/* Private names are terrimpi_ROOM_...: field, camera, tree, mip, impostor and split, atlas and
   pack, terrain with mesh and floor, bake, horizon and walls, capture, view with cull, candidate,
   region, cache and job, sorted, layer; simp and raise, build and fill, layers with mask, cover,
   record and depth, place and prepare. Those without a room are of Basics. */
#ifdef TERRIMP_IMPLEMENTATION
#ifndef TERRIMP_IMPLEMENTATION_ONCE
#define TERRIMP_IMPLEMENTATION_ONCE

/* ==== Configuration ====================================================== >>impl-config */

#ifndef TERRIMP_SQRTF
#include <math.h>
#define TERRIMP_SQRTF(x) sqrtf(x)
#define TERRIMP_SINF(x) sinf(x)
#define TERRIMP_COSF(x) cosf(x)
#define TERRIMP_TANF(x) tanf(x)
#define TERRIMP_ASINF(x) asinf(x)
#define TERRIMP_ACOSF(x) acosf(x)
#define TERRIMP_FABSF(x) fabsf(x)
#endif
#ifndef TERRIMP_FABSF /* one instruction where there is one */
#define TERRIMP_FABSF(x) ((x) < 0.0f ? -(x) : (x))
#endif
#ifndef TERRIMP_ASSERT
#include <assert.h>
#define TERRIMP_ASSERT(condition) assert(condition)
#endif

#ifndef TERRIMP_NO_MALLOC
#ifndef TERRIMP_MALLOC
#include <stdlib.h>
#define TERRIMP_MALLOC(bytes) malloc(bytes)
#define TERRIMP_FREE(pointer) free(pointer)
#endif
#endif

#include <string.h>

#define TERRIMPI_INFINITY HUGE_VALF

/* A function that compilers take to be as small as a call of it, but is not: it is called where
   bytes count. */
#if defined(__GNUC__) && defined(__OPTIMIZE_SIZE__)
#define TERRIMPI_CALL __attribute__((noinline))
#else
#define TERRIMPI_CALL
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ==== Basics ============================================================= >>impl-basics */

/* What most functions begin with: an error is returned when a condition holds; or is passed on. */
#define TERRIMPI_REFUSE(condition, error) \
    do { if (condition) return (error); } while (0)
#define TERRIMPI_TRY(call)             \
    do {                               \
        terrimp_result tried = (call); \
        if (tried != TERRIMP_OK)       \
            return tried;              \
    } while (0)

/* Descriptors say with 0 that they want the default. */
#define TERRIMPI_DEFAULT(field, value) \
    do { if ((field) == 0) (field) = (value); } while (0)

TERRIMP_API const char *terrimp_result_text(int result)
{
    switch (result) {
#define TERRIMPI_X(name, value, text) \
    case value: return text;
        TERRIMP_RESULTS(TERRIMPI_X)
#undef TERRIMPI_X
    default: return "unknown result";
    }
}

/* Rounds what a machine may hold with more precision or range than a float has, as the x87 does:
   for values that are compared with what another place computes anew. */
static float terrimpi_float(float value)
{
#if defined(__FLT_EVAL_METHOD__) && __FLT_EVAL_METHOD__ != 0
    volatile float rounded = value;
    return rounded;
#else
    return value;
#endif
}

static uint32_t terrimpi_float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* But for the sign infinity has the bits TERRIMPI_INFINITE, and NaN has more. Told by bits, since
   compilers may take every number for finite (-ffast-math). */
#define TERRIMPI_INFINITE 0x7f800000u
static uint32_t terrimpi_bits(float value) { return terrimpi_float_bits(value) & 0x7fffffffu; }
static int terrimpi_finite(float value) { return terrimpi_bits(value) < TERRIMPI_INFINITE; }

static int terrimpi_finite3(const float value[3])
{
    return terrimpi_finite(value[0]) && terrimpi_finite(value[1]) && terrimpi_finite(value[2]);
}

static int terrimpi_finite2(float a, float b) { return terrimpi_finite(a) && terrimpi_finite(b); }

/* NaN is not within anything. */
static int terrimpi_within(float v, float low, float high) { return v >= low && v <= high; }

/* What integer a float is at or above. */
static int32_t terrimpi_round_down(float value)
{
    int32_t whole = (int32_t)value;
    return (float)whole > value ? whole - 1 : whole;
}

static int terrimpi_within_u32(uint32_t v, uint32_t low, uint32_t high)
{
    return v >= low && v <= high;
}

static float terrimpi_min(float a, float b) { return a < b ? a : b; }
static float terrimpi_max(float a, float b) { return a > b ? a : b; }
static float terrimpi_abs(float a) { return TERRIMP_FABSF(a); }
static uint32_t terrimpi_min_u32(uint32_t a, uint32_t b) { return a < b ? a : b; }
static uint32_t terrimpi_max_u32(uint32_t a, uint32_t b) { return a > b ? a : b; }

static TERRIMPI_CALL float terrimpi_clamp(float value, float low, float high)
{
    return value > low ? (value < high ? value : high) : low; /* NaN becomes low */
}

static uint32_t terrimpi_clamp_u32(uint32_t value, uint32_t low, uint32_t high)
{
    return terrimpi_min_u32(terrimpi_max_u32(value, low), high);
}

/* The least integer not below a value in 0..2^24. */
static uint32_t terrimpi_ceil_u32(float value)
{
    uint32_t whole = (uint32_t)value;
    return (float)whole < value ? whole + 1u : whole;
}

/* a * b; *ok becomes 0 when the product does not fit. */
static size_t terrimpi_mul(size_t a, size_t b, int *ok)
{
    if (b != 0 && a > (size_t)-1 / b) {
        *ok = 0;
        return 0;
    }
    return a * b;
}

/* a + b; *ok becomes 0 when the sum does not fit. */
static size_t terrimpi_add(size_t a, size_t b, int *ok)
{
    if (a > (size_t)-1 - b) {
        *ok = 0;
        return 0;
    }
    return a + b;
}

#define TERRIMPI_FLOAT_MAX 3.402823466e38f
#define TERRIMPI_ALIGN 8u /* of blocks of memory: pointers, and the simplifier's 64-bit sums */

/* A block of memory that is dealt out array by array: so one list of arrays serves both for laying
   them out and, without a base, for counting the bytes. */
typedef struct terrimpi_arena {
    unsigned char *base;
    size_t bytes;
    int ok; /* nothing has overflowed */
} terrimpi_arena;

static terrimpi_arena terrimpi_arena_at(void *base)
{
    terrimpi_arena arena;
    arena.base = (unsigned char *)base;
    arena.bytes = 0;
    arena.ok = 1;
    return arena;
}

/* `count` items of `size` bytes, all aligned alike. */
static void *terrimpi_take(terrimpi_arena *arena, size_t count, size_t size)
{
    int *ok = &arena->ok;
    size_t at = arena->bytes;
    size_t bytes = terrimpi_add(terrimpi_mul(count, size, ok), TERRIMPI_ALIGN - 1u, ok);
    arena->bytes = terrimpi_add(at, bytes - bytes % TERRIMPI_ALIGN, ok);
    return arena->base && arena->ok ? arena->base + at : NULL;
}

/* Whether a block of memory of the caller's will do. */
static terrimp_result terrimpi_check_block(const void *memory, size_t bytes, size_t needed)
{
    TERRIMPI_REFUSE(!memory, TERRIMP_E_NULL);
    TERRIMPI_REFUSE((uintptr_t)memory % TERRIMPI_ALIGN != 0, TERRIMP_E_ALIGN);
    return bytes < needed ? TERRIMP_E_MEMORY : TERRIMP_OK;
}

static float terrimpi_dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void terrimpi_sub(const float a[3], const float b[3], float out[3])
{
    out[0] = a[0] - b[0];
    out[1] = a[1] - b[1];
    out[2] = a[2] - b[2];
}

static void terrimpi_cross(const float a[3], const float b[3], float out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static float terrimpi_largest(const float v[3])
{
    return terrimpi_max(terrimpi_abs(v[0]), terrimpi_max(terrimpi_abs(v[1]), terrimpi_abs(v[2])));
}

/* Length without overflow or underflow: the largest component is taken out first. */
static float terrimpi_length(const float v[3])
{
    float largest = terrimpi_largest(v), x, y, z;
    if (!(largest > 0.0f))
        return 0.0f;
    x = v[0] / largest;
    y = v[1] / largest;
    z = v[2] / largest;
    return largest * TERRIMP_SQRTF(x * x + y * y + z * z);
}

/* Scales a vector to length 1; returns 0 and leaves it alone when its length is 0 or overflows. */
static int terrimpi_normalize(float v[3])
{
    float length = terrimpi_length(v);
    int i;
    if (!(length > 0.0f) || !terrimpi_finite(length))
        return 0;
    for (i = 0; i < 3; i++)
        v[i] /= length;
    return 1;
}

/* Makes up and right orthonormal to a unit forward. Where up lies along forward, the axis that is
   farthest from forward takes its place. */
static void terrimpi_basis(const float forward[3], float up[3], float right[3])
{
    if (terrimpi_normalize(up))
        terrimpi_cross(forward, up, right);
    else
        right[0] = right[1] = right[2] = 0.0f;
    if (terrimpi_dot(right, right) < 1e-8f) {
        float x = terrimpi_abs(forward[0]), y = terrimpi_abs(forward[1]);
        float z = terrimpi_abs(forward[2]);
        up[0] = up[1] = up[2] = 0.0f;
        up[z <= x && z <= y ? 2 : x <= y ? 0 : 1] = z <= x && z <= y ? -1.0f : 1.0f;
        terrimpi_cross(forward, up, right);
    }
    terrimpi_normalize(right);
    terrimpi_cross(right, forward, up);
}

/* Shell's sort of some numbers by `after`, which says whether a comes after b: no recursion, no
   extra memory. */
static void terrimpi_sort(uint32_t *order, uint32_t count, const void *items,
                          int (*after)(const void *items, uint32_t a, uint32_t b))
{
    uint32_t i, k, gap;
    for (gap = 1; gap < count / 3u;)
        gap = 3u * gap + 1u;
    for (; gap > 0; gap /= 3u)
        for (i = gap; i < count; i++) {
            uint32_t moved = order[i];
            for (k = i; k >= gap && after(items, order[k - gap], moved); k -= gap)
                order[k] = order[k - gap];
            order[k] = moved;
        }
}

/* Whether a side runs along x. */
static int terrimpi_along_x(int side) { return side < (int)TERRIMP_SIDE_X0; }

/* Twice the area of a triangle of samples (x, z); positive when it is counter-clockwise from above:
   when its normal has y > 0. */
static int64_t terrimpi_twice_area(const int64_t a[2], const int64_t b[2], const int64_t c[2])
{
    return (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
}

/* Where point k of a lattice of every 2^level-th sample lies; beyond the last sample, on it. */
static uint32_t terrimpi_lattice(uint32_t k, uint32_t level, uint32_t last)
{
    return k > (last >> level) ? last : k << level;
}

static terrimp_rect terrimpi_rect(uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    terrimp_rect rect;
    rect.x = x;
    rect.y = y;
    rect.width = width;
    rect.height = height;
    return rect;
}

/* Moves the ends of an interval apart by what rounding can have cost: a fraction of their size and
   of 1, times the steepness of the rays that they come from. */
static void terrimpi_widen(float *low, float *high, float slope)
{
    float size = terrimpi_max(terrimpi_abs(*low), terrimpi_abs(*high));
    float margin = slope * (1e-6f * size + 2e-7f);
    *low -= margin;
    *high += margin;
}

#ifndef TERRIMP_NO_TROUBLE

/* A field of a descriptor. */
typedef struct terrimpi_trouble_field {
    const char *name;
    size_t at, bytes;
} terrimpi_trouble_field;

#define TERRIMPI_TROUBLE(type, field) {#field, offsetof(type, field), sizeof(((type *)0)->field)}

/* Takes fields of a good descriptor for those of a bad one, one after the other, until `resolve`
   finds it good; returns the last one, which was wrong, or NULL when none was. */
#define TERRIMPI_FIND_TROUBLE(fields, good, bad, resolve)                                          \
    do {                                                                                           \
        const char *name = NULL;                                                                   \
        size_t i;                                                                                  \
        for (i = 0; i < sizeof(fields) / sizeof *(fields) && (resolve) != TERRIMP_OK; i++) {       \
            name = fields[i].name;                                                                 \
            memcpy((char *)&bad + fields[i].at, (const char *)&good + fields[i].at,                \
                   fields[i].bytes);                                                               \
        }                                                                                          \
        return name;                                                                               \
    } while (0)

#endif /* TERRIMP_NO_TROUBLE */

/* ==== Heightfield ======================================================== >>impl-heightfield */

/* Based on: Bornemann and Deuflhard 1996 (voids), Amanatides and Woo 1987 (ray walk).

   A raw value is a sample as stored, converted to float: exact for all formats. Voids are told by
   raw values; two different raw values may well share one world height. */

/* Bytes of one sample of an effective format. */
static size_t terrimpi_field_sample_bytes(int format)
{
    return format == TERRIMP_FORMAT_U8 ? 1u : format == TERRIMP_FORMAT_F32 ? 4u : 2u;
}

/* The world coordinate of column or row i. Every use of a position goes through here, so that all
   agree on the rounded value. */
static float terrimpi_field_line(float origin, float spacing, uint32_t i)
{
    return terrimpi_float(origin + (float)i * spacing);
}

/* Checks one axis: 2^-23 is the step of a float relative to its value. */
static terrimp_result terrimpi_field_check_axis(float origin, float spacing, uint32_t count)
{
    float extent = (float)(count - 1u) * spacing;
    float last = terrimpi_field_line(origin, spacing, count - 1u);
    float reach = terrimpi_max(extent, terrimpi_max(-origin, terrimpi_max(origin, last)));
    TERRIMPI_REFUSE(!terrimpi_finite(origin) || !terrimpi_finite(spacing), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(spacing > 0.0f) || !terrimpi_finite(reach) ||
                    spacing < reach * (1.0f / 8388608.0f), TERRIMP_E_RANGE);
    return TERRIMP_OK;
}

static terrimp_result terrimpi_field_check_heights(const terrimp_heightfield *field)
{
    float scale = field->height_scale, offset = field->height_offset;
    float height = scale * (field->format == TERRIMP_FORMAT_F32 ? 0.0f : 65535.0f);
    TERRIMPI_REFUSE(!terrimpi_finite2(scale, offset), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(scale > 0.0f) || !terrimpi_finite2(offset + height, offset - height),
                    TERRIMP_E_RANGE);
    return TERRIMP_OK;
}

static terrimp_result terrimpi_field_check_memory(const terrimp_heightfield *field)
{
    size_t size = terrimpi_field_sample_bytes(field->format);
    size_t row = (size_t)field->width * size;
    int ok = 1;
    TERRIMPI_REFUSE(field->row_bytes < row || field->row_bytes % size != 0, TERRIMP_E_RANGE);
    (void)terrimpi_add(terrimpi_mul(field->row_bytes, field->depth - 1u, &ok), row, &ok);
    TERRIMPI_REFUSE(!ok, TERRIMP_E_OVERFLOW);
    return (uintptr_t)field->samples % size != 0 ? TERRIMP_E_ALIGN : TERRIMP_OK;
}

static int terrimpi_field_size_ok(uint32_t width, uint32_t depth)
{
    return terrimpi_within_u32(width, 2u, TERRIMP_MAX_DIM) &&
           terrimpi_within_u32(depth, 2u, TERRIMP_MAX_DIM);
}

TERRIMP_API terrimp_result terrimp_heightfield_resolve(const terrimp_heightfield *in,
                                                       terrimp_heightfield *out)
{
    terrimp_heightfield field;
    TERRIMPI_REFUSE(in == NULL || out == NULL || in->samples == NULL, TERRIMP_E_NULL);
    field = *in;
    TERRIMPI_REFUSE(!terrimpi_field_size_ok(field.width, field.depth) || field.format < 0 ||
                    field.format >= TERRIMP_FORMAT_COUNT, TERRIMP_E_RANGE);
    TERRIMPI_DEFAULT(field.format, TERRIMP_FORMAT_F32);
    TERRIMPI_DEFAULT(field.row_bytes, field.width * terrimpi_field_sample_bytes(field.format));
    TERRIMPI_DEFAULT(field.spacing_x, 1.0f);
    TERRIMPI_DEFAULT(field.spacing_z, 1.0f);
    TERRIMPI_DEFAULT(field.height_scale, 1.0f);
    TERRIMPI_TRY(terrimpi_field_check_axis(field.origin_x, field.spacing_x, field.width));
    TERRIMPI_TRY(terrimpi_field_check_axis(field.origin_z, field.spacing_z, field.depth));
    TERRIMPI_TRY(terrimpi_field_check_heights(&field));
    TERRIMPI_TRY(terrimpi_field_check_memory(&field));
    *out = field;
    return TERRIMP_OK;
}

/* ---- samples of a resolved field, unchecked ---- */

static const void *terrimpi_field_row(const terrimp_heightfield *field, uint32_t z)
{
    return (const char *)field->samples + (size_t)z * field->row_bytes;
}

static float terrimpi_field_raw(const terrimp_heightfield *field, uint32_t x, uint32_t z)
{
    const void *row = terrimpi_field_row(field, z);
    switch (field->format) {
    case TERRIMP_FORMAT_U8: return (float)((const uint8_t *)row)[x];
    case TERRIMP_FORMAT_U16: return (float)((const uint16_t *)row)[x];
    case TERRIMP_FORMAT_S16: return (float)((const int16_t *)row)[x];
    default: return ((const float *)row)[x];
    }
}

static int terrimpi_field_is_void(const terrimp_heightfield *field, float raw)
{
    return field->has_no_data && (raw == field->no_data || terrimpi_bits(raw) > TERRIMPI_INFINITE);
}

static float terrimpi_field_world_height(const terrimp_heightfield *field, float raw)
{
    return terrimpi_float(field->height_offset + field->height_scale * raw);
}

/* The world height of sample (x, z); a void gives the height of its no-data value. */
static float terrimpi_field_sample(const terrimp_heightfield *field, uint32_t x, uint32_t z)
{
    return terrimpi_field_world_height(field, terrimpi_field_raw(field, x, z));
}

/* Reads out[cols] samples of row z from column x on, as offset + scale * raw value; columns beyond
   the last repeat it. */
static void terrimpi_field_read_row(const terrimp_heightfield *field, uint32_t x, uint32_t z,
                                    uint32_t cols, uint32_t stride, float offset, float scale,
                                    float *out)
{
    const uint32_t last = field->width - 1u;
    const uint32_t first = x < last ? x : last;
    const uint32_t steps = (last - first) / stride;
    const uint32_t inside = steps < cols ? steps + 1u : cols;
    const void *row = terrimpi_field_row(field, z);
    uint32_t c;
    /* Two loops, for the one of stride 1 turns into vector instructions. */
#define TERRIMPI_FIELD_COPY(type)                                            \
    if (stride == 1u)                                                        \
        for (c = 0; c < inside; ++c)                                         \
            out[c] = offset + scale * (float)((const type *)row)[first + c]; \
    else                                                                     \
        for (c = 0; c < inside; ++c)                                         \
            out[c] = offset + scale * (float)((const type *)row)[first + c * stride]

    switch (field->format) {
    case TERRIMP_FORMAT_U8: TERRIMPI_FIELD_COPY(uint8_t); break;
    case TERRIMP_FORMAT_U16: TERRIMPI_FIELD_COPY(uint16_t); break;
    case TERRIMP_FORMAT_S16: TERRIMPI_FIELD_COPY(int16_t); break;
    default: TERRIMPI_FIELD_COPY(float); break;
    }
#undef TERRIMPI_FIELD_COPY

    for (c = inside; c < cols; ++c)
        out[c] = offset + scale * terrimpi_field_raw(field, last, z);
}

/* from + steps * stride, not beyond last. */
static uint32_t terrimpi_field_step(uint32_t from, uint32_t last, uint32_t steps, uint32_t stride)
{
    return steps > (last - from) / stride ? last : from + steps * stride;
}

/* Reads a [rows][cols] tile of world heights from sample (x, z) on at a stride; columns and rows
   beyond the last repeat it. Voids come out as the height of their no-data value. */
static void terrimpi_field_tile(const terrimp_heightfield *field, uint32_t x, uint32_t z,
                                uint32_t cols, uint32_t rows, uint32_t stride, float *out)
{
    const uint32_t last = field->depth - 1u;
    uint32_t r;
    z = z < last ? z : last;
    for (r = 0; r < rows; ++r, out += cols)
        terrimpi_field_read_row(field, x, terrimpi_field_step(z, last, r, stride), cols, stride,
                                field->height_offset, field->height_scale, out);
}

/* The result of a look at every sample of a tile. */
typedef struct terrimpi_field_scan {
    int skip_voids;  /* given: voids are but counted, and low > high if there is nothing else */
    size_t voids;
    float low, high; /* raw range */
    uint32_t x, z;   /* the first bad sample, if the scan fails */
} terrimpi_field_scan;

/* Looks at count raw values; when one is bad, *bad says which. */
static terrimp_result terrimpi_field_scan_values(const terrimp_heightfield *field, const float *raw,
                                                 uint32_t count, uint32_t *bad,
                                                 terrimpi_field_scan *scan)
{
    uint32_t i;
    for (i = 0; i < count; ++i) {
        if (!field->has_no_data && terrimpi_within(raw[i], scan->low, scan->high))
            continue; /* between two that are good */
        if (terrimpi_field_is_void(field, raw[i])) {
            scan->voids++;
            if (scan->skip_voids)
                continue;
            *bad = i;
            return TERRIMP_E_VOID;
        }
        if (!terrimpi_finite(terrimpi_field_world_height(field, raw[i]))) {
            *bad = i;
            return TERRIMP_E_NOT_FINITE;
        }
        scan->low = terrimpi_min(scan->low, raw[i]);
        scan->high = terrimpi_max(scan->high, raw[i]);
    }
    return TERRIMP_OK;
}

/* Scans a tile as terrimpi_field_tile would read it; repeated samples get one look. */
static terrimp_result terrimpi_field_scan_tile(const terrimp_heightfield *field, uint32_t x,
                                               uint32_t z,
                                               uint32_t cols, uint32_t rows, uint32_t stride,
                                               terrimpi_field_scan *scan)
{
    float raw[256];
    const uint32_t last_x = field->width - 1u, last_z = field->depth - 1u;
    const uint32_t most = (last_x - x) / stride + 2u; /* the last of these is the last column */
    uint32_t r, c, at, row, count, bad = 0;
    terrimp_result result;
    scan->low = TERRIMPI_FLOAT_MAX;
    scan->high = -TERRIMPI_FLOAT_MAX;
    scan->voids = 0;
    cols = cols < most ? cols : most;
    for (r = 0; r < rows; ++r) {
        row = terrimpi_field_step(z, last_z, r, stride);
        for (c = 0; c < cols; c += count) {
            at = terrimpi_field_step(x, last_x, c, stride);
            count = cols - c < 256u ? cols - c : 256u;
            terrimpi_field_read_row(field, at, row, count, stride, 0.0f, 1.0f, raw);
            result = terrimpi_field_scan_values(field, raw, count, &bad, scan);
            if (result != TERRIMP_OK) {
                scan->x = terrimpi_field_step(at, last_x, bad, stride);
                scan->z = row;
                return result;
            }
        }
        if (row == last_z)
            break;
    }
    return TERRIMP_OK;
}

/* Whether a rectangle of samples has any that the field has, too. */
static int terrimpi_field_has(const terrimp_heightfield *f, const terrimp_rect *samples)
{
    return samples->x < f->width && samples->y < f->depth && samples->width > 0 &&
           samples->height > 0;
}

TERRIMP_API terrimp_result terrimp_heightfield_validate(const terrimp_heightfield *field,
                                                        uint32_t *x, uint32_t *z)
{
    terrimp_heightfield f;
    terrimpi_field_scan scan;
    terrimp_result result;
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    scan.skip_voids = 0;
    result = terrimpi_field_scan_tile(&f, 0, 0, f.width, f.depth, 1, &scan);
    if (result != TERRIMP_OK) {
        if (x != NULL)
            *x = scan.x;
        if (z != NULL)
            *z = scan.z;
    }
    return result;
}

TERRIMP_API terrimp_result terrimp_heightfield_read(const terrimp_heightfield *field, uint32_t x,
                                                    uint32_t z, uint32_t cols, uint32_t rows,
                                                    uint32_t stride, float *out)
{
    terrimp_heightfield f;
    terrimpi_field_scan scan;
    int ok = 1;
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_REFUSE(out == NULL, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(x >= f.width || z >= f.depth || cols == 0 || rows == 0 ||
                    stride == 0, TERRIMP_E_RANGE);
    (void)terrimpi_mul(terrimpi_mul(cols, rows, &ok), sizeof(float), &ok);
    TERRIMPI_REFUSE(!ok, TERRIMP_E_OVERFLOW);
    scan.skip_voids = 0;
    TERRIMPI_TRY(terrimpi_field_scan_tile(&f, x, z, cols, rows, stride, &scan));
    terrimpi_field_tile(&f, x, z, cols, rows, stride, out);
    return TERRIMP_OK;
}

/* The range of the world heights of a rectangle of samples, cut at the last column and row.
   Rounding keeps the order, and the scale is positive: the raw range maps to the exact one. */
static terrimp_result terrimpi_field_range(const terrimp_heightfield *field, terrimp_rect samples,
                                           int skip_voids, float *low, float *high)
{
    terrimpi_field_scan scan;
    scan.skip_voids = skip_voids;
    TERRIMPI_TRY(terrimpi_field_scan_tile(field, samples.x, samples.y, samples.width,
                                          samples.height, 1, &scan));
    TERRIMPI_REFUSE(scan.low > scan.high, TERRIMP_E_VOID);
    *low = terrimpi_field_world_height(field, scan.low);
    *high = terrimpi_field_world_height(field, scan.high);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_heightfield_bounds(const terrimp_heightfield *field, uint32_t x,
                                                      uint32_t z, uint32_t cols, uint32_t rows,
                                                      float *low, float *high)
{
    terrimp_heightfield f;
    terrimp_rect samples = terrimpi_rect(x, z, cols, rows);
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_REFUSE(low == NULL || high == NULL, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_field_has(&f, &samples), TERRIMP_E_RANGE);
    return terrimpi_field_range(&f, samples, 1, low, high);
}

/* ---- queries on the surface ---- */

/* One quad: heights of its corners and where it lies. */
typedef struct terrimpi_field_quad {
    float h[4]; /* of (0, 0), (1, 0), (0, 1), (1, 1) */
    float x0, x1, z0, z1;
} terrimpi_field_quad;

/* Finds the quad that holds a coordinate along one axis; 0 when it is outside. The quotient is only
   a guess where the origin is distant; the lines themselves decide. */
static int terrimpi_field_locate_along(float origin, float spacing, uint32_t count, float at,
                                       uint32_t *quad)
{
    float guess = (at - origin) / spacing;
    uint32_t i;
    if (!(at >= origin && at <= terrimpi_field_line(origin, spacing, count - 1u)))
        return 0;
    i = (uint32_t)terrimpi_clamp(guess, 0.0f, (float)(count - 2u));
    while (i > 0 && at < terrimpi_field_line(origin, spacing, i))
        --i;
    while (i < count - 2u && at >= terrimpi_field_line(origin, spacing, i + 1u))
        ++i;
    *quad = i;
    return 1;
}

static int terrimpi_field_locate(const terrimp_heightfield *f, float x, float z, uint32_t *i,
                                 uint32_t *j)
{
    return terrimpi_field_locate_along(f->origin_x, f->spacing_x, f->width, x, i) &&
           terrimpi_field_locate_along(f->origin_z, f->spacing_z, f->depth, z, j);
}

/* Fills quad; on E_VOID and E_NOT_FINITE, when it is a hole, only the place of it. */
static terrimp_result terrimpi_field_quad_load(const terrimp_heightfield *field, uint32_t x,
                                               uint32_t z, terrimpi_field_quad *quad)
{
    float none = 0.0f;
    uint32_t i;
    quad->x0 = terrimpi_field_line(field->origin_x, field->spacing_x, x);
    quad->x1 = terrimpi_field_line(field->origin_x, field->spacing_x, x + 1u);
    quad->z0 = terrimpi_field_line(field->origin_z, field->spacing_z, z);
    quad->z1 = terrimpi_field_line(field->origin_z, field->spacing_z, z + 1u);
    for (i = 0; i < 4u; ++i) {
        float raw = terrimpi_field_raw(field, x + (i & 1u), z + (i >> 1));
        TERRIMPI_REFUSE(terrimpi_field_is_void(field, raw), TERRIMP_E_VOID);
        quad->h[i] = terrimpi_field_world_height(field, raw);
        none += 0.0f * quad->h[i];
    }
    return terrimpi_finite(none) ? TERRIMP_OK : TERRIMP_E_NOT_FINITE;
}

/* Where a coordinate lies between two lines, 0..1. */
static float terrimpi_field_fraction(float at, float low, float high)
{
    return high > low ? terrimpi_clamp((at - low) / (high - low), 0.0f, 1.0f) : 0.0f;
}

/* Which triangle: 1 is (0,0),(0,1),(1,1), towards +z; 0 is (0,0),(1,1),(1,0), towards +x. */
static int terrimpi_field_quad_side(float u, float v)
{
    return v >= u;
}

/* The height of a triangle's plane at fractions u (x) and v (z). The weights make it exact at the
   corners, and on a shared edge both triangles compute the very same number. */
static float terrimpi_field_quad_height(const terrimpi_field_quad *quad, int side, float u, float v)
{
    if (side)
        return quad->h[0] * (1.0f - v) + quad->h[2] * (v - u) + quad->h[3] * u;
    return quad->h[0] * (1.0f - u) + quad->h[1] * (u - v) + quad->h[3] * v;
}

/* Height gained per world unit along x and along z. */
static void terrimpi_field_quad_slope(const terrimpi_field_quad *quad, int side, float slope[2])
{
    float along_x = side ? quad->h[3] - quad->h[2] : quad->h[1] - quad->h[0];
    float along_z = side ? quad->h[2] - quad->h[0] : quad->h[3] - quad->h[1];
    slope[0] = along_x / (quad->x1 - quad->x0);
    slope[1] = along_z / (quad->z1 - quad->z0);
}

/* The upward unit normal of a triangle; 0 when its slope is beyond float. */
static int terrimpi_field_quad_normal(const terrimpi_field_quad *quad, int side, float normal[3])
{
    float n[3], slope[2];
    terrimpi_field_quad_slope(quad, side, slope);
    n[0] = -slope[0];
    n[1] = 1.0f;
    n[2] = -slope[1];
    if (!terrimpi_normalize(n) || !(n[1] > 0.0f))
        return 0;
    memcpy(normal, n, sizeof n);
    return 1;
}

/* [wu] after which a field that wraps repeats itself. */
static float terrimpi_field_period(const terrimp_heightfield *f, int axis)
{
    return axis == 0 ? f->spacing_x * (float)(f->width - 1u)
                     : f->spacing_z * (float)(f->depth - 1u);
}

/* Takes a coordinate to the repetition that the samples lie in; what it is moved by, in periods. */
static float terrimpi_field_wrap(const terrimp_heightfield *f, int axis, float *at)
{
    float origin = axis == 0 ? f->origin_x : f->origin_z;
    float spacing = axis == 0 ? f->spacing_x : f->spacing_z;
    uint32_t last = (axis == 0 ? f->width : f->depth) - 1u;
    float period = terrimpi_field_period(f, axis), away = (*at - origin) / period, whole;
    if (!f->wrap || !(terrimpi_abs(away) < 8388608.0f))
        return 0.0f;
    whole = (float)(int32_t)away;
    whole -= whole > away ? 1.0f : 0.0f;
    *at = terrimpi_clamp(*at - whole * period, origin, terrimpi_field_line(origin, spacing, last));
    return whole;
}

/* What height and normal share: the quad at a world position and the place in it. */
static terrimp_result terrimpi_field_surface(const terrimp_heightfield *field, float x, float z,
                                             terrimpi_field_quad *quad, float *u, float *v)
{
    terrimp_heightfield f;
    uint32_t i, j;
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_REFUSE(!terrimpi_finite2(x, z), TERRIMP_E_NOT_FINITE);
    (void)terrimpi_field_wrap(&f, 0, &x);
    (void)terrimpi_field_wrap(&f, 1, &z);
    TERRIMPI_REFUSE(!terrimpi_field_locate(&f, x, z, &i, &j), TERRIMP_E_MISS);
    TERRIMPI_TRY(terrimpi_field_quad_load(&f, i, j, quad));
    *u = terrimpi_field_fraction(x, quad->x0, quad->x1);
    *v = terrimpi_field_fraction(z, quad->z0, quad->z1);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_heightfield_height(const terrimp_heightfield *field, float x,
                                                      float z, float *height)
{
    terrimpi_field_quad quad;
    float u, v;
    TERRIMPI_REFUSE(height == NULL, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_field_surface(field, x, z, &quad, &u, &v));
    *height = terrimpi_field_quad_height(&quad, terrimpi_field_quad_side(u, v), u, v);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_heightfield_normal(const terrimp_heightfield *field, float x,
                                                      float z, float normal[3])
{
    terrimpi_field_quad quad;
    float u, v;
    TERRIMPI_REFUSE(normal == NULL, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_field_surface(field, x, z, &quad, &u, &v));
    return terrimpi_field_quad_normal(&quad, terrimpi_field_quad_side(u, v), normal) ? TERRIMP_OK
                                                                         : TERRIMP_E_NOT_FINITE;
}

/* ---- the ray ----

   Above each quad the ray is cut where it crosses the quad's border and its diagonal. Over such a
   piece the gap between ray and surface is linear, so the two meet where the gap changes its sign.
   The side of the surface on which a piece ends is handed on to the next and not found anew there,
   where it could be rounded to the other: no ray slips through between two triangles. */

/* A point of the ray above one quad. */
typedef struct terrimpi_field_ray_point {
    float t;    /* [wu] from the start of the walk */
    float y;
    float u, v; /* place in the quad */
    int above;  /* the surface: 1, or -1 for below; 0 while it is not known */
} terrimpi_field_ray_point;

/* The part of a ray above the field. */
typedef struct terrimpi_field_ray {
    float start[3];
    float way[3];   /* unit length */
    float before;   /* [wu] from the caller's origin to start */
    float length;   /* [wu] from start to the end */
    float periods[2]; /* of a field that wraps, from start to where the caller's origin is */
} terrimpi_field_ray;

/* Narrows [*t0, *t1] to where start + t * way is within [low, high]; 0 when nothing is left. */
static int terrimpi_field_ray_clip(float start, float way, float low, float high, float *t0,
                                   float *t1)
{
    float a, b;
    if (way == 0.0f)
        return start >= low && start <= high;
    a = ((way > 0.0f ? low : high) - start) / way;
    b = ((way > 0.0f ? high : low) - start) / way;
    *t0 = terrimpi_max(*t0, a);
    *t1 = terrimpi_min(*t1, b);
    return *t0 <= *t1;
}

/* Makes the way a unit vector; 0 when it is zero. Even the longest direction has a length once its
   largest component is 1. */
static int terrimpi_field_ray_aim(const float direction[3], float way[3])
{
    float largest = terrimpi_largest(direction);
    if (!(largest > 0.0f))
        return 0;
    way[0] = direction[0] / largest;
    way[1] = direction[1] / largest;
    way[2] = direction[2] / largest;
    return terrimpi_normalize(way);
}

/* The ray starts anew where it enters the field, so that later steps count from close by. */
static int terrimpi_field_ray_enter(const terrimp_heightfield *field, const float origin[3],
                                    float max_distance, terrimpi_field_ray *ray)
{
    float last_x = terrimpi_field_line(field->origin_x, field->spacing_x, field->width - 1u);
    float last_z = terrimpi_field_line(field->origin_z, field->spacing_z, field->depth - 1u);
    float t0 = 0.0f, t1 = max_distance;
    memcpy(ray->start, origin, sizeof ray->start);
    ray->periods[0] = terrimpi_field_wrap(field, 0, &ray->start[0]);
    ray->periods[1] = terrimpi_field_wrap(field, 1, &ray->start[2]);
    ray->before = 0.0f;
    ray->length = max_distance;
    if (field->wrap)
        return 1;
    if (!terrimpi_field_ray_clip(origin[0], ray->way[0], field->origin_x, last_x, &t0, &t1) ||
        !terrimpi_field_ray_clip(origin[2], ray->way[2], field->origin_z, last_z, &t0, &t1))
        return 0;
    ray->start[0] = terrimpi_clamp(origin[0] + t0 * ray->way[0], field->origin_x, last_x);
    ray->start[1] = origin[1] + t0 * ray->way[1];
    ray->start[2] = terrimpi_clamp(origin[2] + t0 * ray->way[2], field->origin_z, last_z);
    ray->before = t0;
    ray->length = t1 - t0;

    /* A long way before rounds the length: what is left is measured from the new start. */
    t0 = 0.0f;
    t1 = terrimpi_max(max_distance - ray->before, 0.0f);
    if (terrimpi_field_ray_clip(ray->start[0], ray->way[0], field->origin_x, last_x, &t0, &t1) &&
        terrimpi_field_ray_clip(ray->start[2], ray->way[2], field->origin_z, last_z, &t0, &t1))
        ray->length = t1;
    return 1;
}

static terrimpi_field_ray_point terrimpi_field_ray_at(const terrimpi_field_ray *ray,
                                                      const terrimpi_field_quad *quad, float t)
{
    terrimpi_field_ray_point point;
    point.t = t;
    point.y = ray->start[1] + t * ray->way[1];
    point.u = terrimpi_field_fraction(ray->start[0] + t * ray->way[0], quad->x0, quad->x1);
    point.v = terrimpi_field_fraction(ray->start[2] + t * ray->way[2], quad->z0, quad->z1);
    point.above = 0;
    return point;
}

/* Does the piece a..b, all above one triangle, meet it? Then *t is where. Else b knows its side. */
static int terrimpi_field_ray_meets(const terrimpi_field_ray *ray, const terrimpi_field_quad *quad,
                                    int side,
                                    const terrimpi_field_ray_point *a, terrimpi_field_ray_point *b,
                                    float *t)
{
    float gap_a = a->y - terrimpi_field_quad_height(quad, side, a->u, a->v);
    float gap_b = b->y - terrimpi_field_quad_height(quad, side, b->u, b->v);
    int above = a->above != 0 ? a->above : (gap_a > 0.0f) - (gap_a < 0.0f);
    float slope[2], closing;
    b->above = (gap_b > 0.0f) - (gap_b < 0.0f);
    if (above != 0 && above == b->above)
        return 0;
    terrimpi_field_quad_slope(quad, side, slope);
    closing = slope[0] * ray->way[0] + slope[1] * ray->way[2] - ray->way[1];
    *t = terrimpi_clamp(a->t + gap_a / closing, a->t, b->t); /* a->t too if it lies in the plane */
    return 1;
}

/* The first meeting within one quad, between two points of the ray on its border. */
static int terrimpi_field_ray_quad(const terrimpi_field_ray *ray, const terrimpi_field_quad *quad,
                                   const terrimpi_field_ray_point *a, terrimpi_field_ray_point *b,
                                   int *side, float *t)
{
    float off_a = a->v - a->u, off_b = b->v - b->u, s;
    const float *h = quad->h;
    float low = terrimpi_min(terrimpi_min(h[0], h[1]), terrimpi_min(h[2], h[3]));
    float high = terrimpi_max(terrimpi_max(h[0], h[1]), terrimpi_max(h[2], h[3]));
    terrimpi_field_ray_point cut;
    b->above = terrimpi_min(a->y, b->y) > high ? 1 : terrimpi_max(a->y, b->y) < low ? -1 : 0;
    if (b->above != 0 && (a->above == 0 || a->above == b->above))
        return 0;
    *side = terrimpi_field_quad_side(0.0f, off_a + off_b);
    if (!((off_a > 0.0f && off_b < 0.0f) || (off_a < 0.0f && off_b > 0.0f)))
        return terrimpi_field_ray_meets(ray, quad, *side, a, b, t);

    s = off_a / (off_a - off_b);
    cut = terrimpi_field_ray_at(ray, quad, a->t + s * (b->t - a->t));
    cut.u = cut.v = a->u + s * (b->u - a->u);
    *side = off_a > 0.0f;
    if (terrimpi_field_ray_meets(ray, quad, *side, a, &cut, t))
        return 1;
    *side = !*side;
    return terrimpi_field_ray_meets(ray, quad, *side, &cut, b, t);
}

/* Where the ray crosses the quad's border along one axis, counted from its start. */
static float terrimpi_field_ray_leave(float start, float way, float low, float high)
{
    if (way == 0.0f)
        return TERRIMPI_FLOAT_MAX;
    return ((way > 0.0f ? high : low) - start) / way;
}

static void terrimpi_field_ray_report(const terrimp_heightfield *field,
                                      const terrimpi_field_ray *ray,
                                      const terrimpi_field_quad *quad, int side, float t,
                                      terrimp_ray_hit *hit)
{
    terrimpi_field_ray_point point = terrimpi_field_ray_at(ray, quad, t);
    hit->distance = ray->before + t;
    hit->position[0] = terrimpi_clamp(ray->start[0] + t * ray->way[0], quad->x0, quad->x1) +
                       ray->periods[0] * terrimpi_field_period(field, 0);
    hit->position[1] = terrimpi_field_quad_height(quad, side, point.u, point.v);
    hit->position[2] = terrimpi_clamp(ray->start[2] + t * ray->way[2], quad->z0, quad->z1) +
                       ray->periods[1] * terrimpi_field_period(field, 1);
    if (!terrimpi_field_quad_normal(quad, side, hit->normal)) { /* steeper than float can say */
        hit->normal[0] = hit->normal[2] = 0.0f;
        hit->normal[1] = 1.0f;
    }
}

/* Takes the ray into the next repetition of the field, to its first or last quad. */
static void terrimpi_field_ray_repeat(const terrimp_heightfield *field, terrimpi_field_ray *ray,
                                      int axis, uint32_t *index)
{
    float step = ray->way[2 * axis] > 0.0f ? 1.0f : -1.0f;
    ray->start[2 * axis] -= step * terrimpi_field_period(field, axis);
    ray->periods[axis] += step;
    *index = step > 0.0f ? 0u : (axis == 0 ? field->width : field->depth) - 2u;
}

/* Walks from quad to quad until one is hit. Each turn takes a step along x or z and never back, so
   there are at most width + depth turns, in a field that wraps as many as the ray crosses quads. */
static terrimp_result terrimpi_field_ray_walk(const terrimp_heightfield *field,
                                              terrimpi_field_ray *ray,
                                              uint32_t x, uint32_t z, terrimp_ray_hit *hit)
{
    terrimpi_field_quad quad;
    terrimp_result loaded = terrimpi_field_quad_load(field, x, z, &quad);
    terrimpi_field_ray_point enter = terrimpi_field_ray_at(ray, &quad, 0.0f);
    for (;;) {
        float leave_x = terrimpi_field_ray_leave(ray->start[0], ray->way[0], quad.x0, quad.x1);
        float leave_z = terrimpi_field_ray_leave(ray->start[2], ray->way[2], quad.z0, quad.z1);
        float next = terrimpi_min(leave_x, leave_z), t;
        int along_x = leave_x <= leave_z, ends = !(next < ray->length), side;
        float way = along_x ? ray->way[0] : ray->way[2];
        uint32_t *index = along_x ? &x : &z, last = (along_x ? field->width : field->depth) - 2u;
        terrimpi_field_ray_point leave =
            terrimpi_field_ray_at(ray, &quad, terrimpi_clamp(next, enter.t, ray->length));
        float *across = along_x ? &leave.u : &leave.v;
        int at_end = *index == (way > 0.0f ? last : 0u);

        if (!ends) /* the border is crossed at exactly 0 or 1, whatever the rounding */
            *across = way > 0.0f ? 1.0f : 0.0f;
        if (loaded == TERRIMP_OK && terrimpi_field_ray_quad(ray, &quad, &enter, &leave, &side,
                                                            &t)) {
            if (hit != NULL) {
                terrimpi_field_ray_report(field, ray, &quad, side, t, hit);
                hit->x = x;
                hit->z = z;
            }
            return TERRIMP_OK;
        }
        TERRIMPI_REFUSE(ends || (at_end && !field->wrap), TERRIMP_E_MISS);
        if (at_end)
            terrimpi_field_ray_repeat(field, ray, !along_x, index);
        else
            *index = way > 0.0f ? *index + 1u : *index - 1u;
        *across = 1.0f - *across;
        enter = leave;
        loaded = terrimpi_field_quad_load(field, x, z, &quad);
    }
}

TERRIMP_API terrimp_result terrimp_heightfield_raycast(const terrimp_heightfield *field,
                                                       const float origin[3],
                                                       const float direction[3],
                                                       float max_distance, terrimp_ray_hit *hit)
{
    terrimp_heightfield f;
    terrimpi_field_ray ray;
    uint32_t x, z;
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_REFUSE(origin == NULL || direction == NULL, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(origin) || !terrimpi_finite3(direction) ||
                    !terrimpi_finite(max_distance), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(max_distance > 0.0f) || !terrimpi_field_ray_aim(direction, ray.way) ||
                    (f.wrap && max_distance > 1048576.0f * terrimpi_max(f.spacing_x, f.spacing_z)),
                    TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!terrimpi_field_ray_enter(&f, origin, max_distance, &ray) ||
                    !terrimpi_field_locate(&f, ray.start[0], ray.start[2], &x, &z), TERRIMP_E_MISS);
    return terrimpi_field_ray_walk(&f, &ray, x, z, hit);
}

#ifndef TERRIMP_NO_TROUBLE

TERRIMP_API const char *terrimp_heightfield_trouble(const terrimp_heightfield *field)
{
    static const terrimpi_trouble_field fields[] = {
        TERRIMPI_TROUBLE(terrimp_heightfield, samples),
        TERRIMPI_TROUBLE(terrimp_heightfield, width),
        TERRIMPI_TROUBLE(terrimp_heightfield, depth),
        TERRIMPI_TROUBLE(terrimp_heightfield, format),
        TERRIMPI_TROUBLE(terrimp_heightfield, row_bytes),
        TERRIMPI_TROUBLE(terrimp_heightfield, spacing_x),
        TERRIMPI_TROUBLE(terrimp_heightfield, spacing_z),
        TERRIMPI_TROUBLE(terrimp_heightfield, height_scale),
        TERRIMPI_TROUBLE(terrimp_heightfield, height_offset),
        TERRIMPI_TROUBLE(terrimp_heightfield, origin_x),
        TERRIMPI_TROUBLE(terrimp_heightfield, origin_z),
        TERRIMPI_TROUBLE(terrimp_heightfield, no_data)
    };
    terrimp_heightfield good, bad;
    if (!field)
        return "the descriptor";
    memset(&good, 0, sizeof good);
    good.samples = &good; /* aligned for any */
    good.width = good.depth = 2;
    bad = *field;
    TERRIMPI_FIND_TROUBLE(fields, good, bad, terrimp_heightfield_resolve(&bad, &bad));
}

#endif /* TERRIMP_NO_TROUBLE */

/* ==== Camera ============================================================= >>impl-camera */
/* Based on: Hess 2010, section 3.2 (fitted frustum); de Boer 2000, sections 2.2 and 2.3.1.2. */

#define TERRIMPI_CAMERA_FARTHEST 1e18f /* of coordinates: products of two distances stay finite */

/* Whether two vectors are of unit length and at a right angle, but for rounding. */
static int terrimpi_camera_orthonormal(const float a[3], const float b[3])
{
    return terrimpi_abs(terrimpi_dot(a, a) - 1.0f) < 4e-6f &&
           terrimpi_abs(terrimpi_dot(b, b) - 1.0f) < 4e-6f &&
           terrimpi_abs(terrimpi_dot(a, b)) < 2e-6f;
}

static int terrimpi_camera_has_sides(const terrimp_camera *c)
{
    return c->sides[0] != 0.0f || c->sides[1] != 0.0f || c->sides[2] != 0.0f ||
           c->sides[3] != 0.0f;
}

/* Whether a camera's sides are within their limits, with some size for a float to tell. */
static int terrimpi_camera_sides_fit(const terrimp_camera *c)
{
    float most = c->orthographic ? TERRIMPI_CAMERA_FARTHEST : 1e4f;
    int i;
    if (!terrimpi_camera_has_sides(c))
        return !c->orthographic;
    for (i = 0; i < 4; i += 2) {
        const float *s = c->sides + i;
        float larger = terrimpi_max(terrimpi_abs(s[0]), terrimpi_abs(s[1]));
        if (larger > most || !(s[1] - s[0] > 1e-5f * larger))
            return 0;
    }
    return 1;
}

TERRIMP_API terrimp_result terrimp_camera_resolve(const terrimp_camera *camera, terrimp_camera *out)
{
    terrimp_camera c;
    float right[3];
    TERRIMPI_REFUSE(!camera || !out, TERRIMP_E_NULL);
    c = *camera;
    TERRIMPI_REFUSE(!terrimpi_finite3(c.eye) || !terrimpi_finite3(c.forward) ||
                    !terrimpi_finite3(c.up) || !terrimpi_finite2(c.z_near, c.z_far) ||
                    !terrimpi_finite3(c.sides) || !terrimpi_finite2(c.sides[3], c.reach) ||
                    !terrimpi_finite(c.fov_y_rad), TERRIMP_E_NOT_FINITE);
    TERRIMPI_DEFAULT(c.fov_y_rad, 1.0471976f);
    if (!c.orthographic && (c.z_far == 0.0f || c.z_far > TERRIMPI_CAMERA_FARTHEST))
        c.z_far = TERRIMPI_FLOAT_MAX;
    if (c.up[0] == 0.0f && c.up[1] == 0.0f && c.up[2] == 0.0f)
        c.up[1] = 1.0f;
    TERRIMPI_REFUSE(!terrimpi_within(c.fov_y_rad, 0.001f, 3.1f) ||
                    !terrimpi_within_u32(c.width_px, 1u, 65536u) ||
                    !terrimpi_within_u32(c.height_px, 1u, 65536u) || c.z_far <= c.z_near ||
                    (c.orthographic ? c.z_far > TERRIMPI_CAMERA_FARTHEST ||
                     c.z_near < -TERRIMPI_CAMERA_FARTHEST
                                    : c.z_near <= 0.0f) || !terrimpi_camera_sides_fit(&c) ||
                    !terrimpi_within(c.reach, 0.0f, TERRIMPI_CAMERA_FARTHEST) ||
                    terrimpi_largest(c.eye) > TERRIMPI_CAMERA_FARTHEST, TERRIMP_E_RANGE);
    if (!terrimpi_camera_orthonormal(c.forward, c.up)) { /* what is resolved stays as it is */
        TERRIMPI_REFUSE(!terrimpi_normalize(c.forward), TERRIMP_E_RANGE);
        terrimpi_basis(c.forward, c.up, right);
    }
    *out = c;
    return TERRIMP_OK;
}

#ifndef TERRIMP_NO_TROUBLE

TERRIMP_API const char *terrimp_camera_trouble(const terrimp_camera *camera)
{
    static const terrimpi_trouble_field fields[] = {
        TERRIMPI_TROUBLE(terrimp_camera, eye), TERRIMPI_TROUBLE(terrimp_camera, forward),
        TERRIMPI_TROUBLE(terrimp_camera, up), TERRIMPI_TROUBLE(terrimp_camera, fov_y_rad),
        TERRIMPI_TROUBLE(terrimp_camera, width_px), TERRIMPI_TROUBLE(terrimp_camera, height_px),
        TERRIMPI_TROUBLE(terrimp_camera, z_near), TERRIMPI_TROUBLE(terrimp_camera, z_far),
        TERRIMPI_TROUBLE(terrimp_camera, orthographic), TERRIMPI_TROUBLE(terrimp_camera, sides),
        TERRIMPI_TROUBLE(terrimp_camera, reach)
    };
    terrimp_camera good, bad;
    if (!camera)
        return "the descriptor";
    memset(&good, 0, sizeof good);
    good.forward[2] = -1.0f;
    good.width_px = good.height_px = 1;
    good.z_near = 1.0f;
    bad = *camera;
    TERRIMPI_FIND_TROUBLE(fields, good, bad, terrimp_camera_resolve(&bad, &bad));
}

#endif /* TERRIMP_NO_TROUBLE */

/* The sides of a resolved camera's screen at distance 1: left, right, down, up. */
static void terrimpi_camera_sides(const terrimp_camera *camera, float sides[4])
{
    memcpy(sides, camera->sides, sizeof camera->sides);
    if (terrimpi_camera_has_sides(camera))
        return;
    sides[3] = TERRIMP_TANF(camera->fov_y_rad * 0.5f);
    sides[1] = sides[3] * (float)camera->width_px / (float)camera->height_px;
    sides[0] = -sides[1];
    sides[2] = -sides[3];
}

/* How far the screen reaches to either side of forward, up or down from it, at distance 1. */
static void terrimpi_camera_tangents(const terrimp_camera *camera, float *tan_x, float *tan_y)
{
    float sides[4];
    terrimpi_camera_sides(camera, sides);
    *tan_x = terrimpi_max(-sides[0], sides[1]);
    *tan_y = terrimpi_max(-sides[2], sides[3]);
}

/* The frustum of a resolved camera, as that of a capture. */
static void terrimpi_camera_capture(const terrimp_camera *camera, terrimp_capture *out)
{
    float sides[4];
    memcpy(out->eye, camera->eye, sizeof out->eye);
    memcpy(out->up, camera->up, sizeof out->up);
    memcpy(out->forward, camera->forward, sizeof out->forward);
    terrimpi_cross(camera->forward, camera->up, out->right);
    out->z_near = camera->z_near;
    out->z_far = camera->z_far;
    terrimpi_camera_sides(camera, sides);
    out->tan_left = sides[0];
    out->tan_right = sides[1];
    out->tan_down = sides[2];
    out->tan_up = sides[3];
    out->orthographic = camera->orthographic != 0;
}

TERRIMP_API terrimp_result terrimp_camera_matrices(const terrimp_camera *camera, float view[16],
                                                   float projection[16])
{
    terrimp_camera resolved;
    terrimp_capture c;
    TERRIMPI_REFUSE(!view || !projection, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &resolved));
    terrimpi_camera_capture(&resolved, &c);
    return terrimp_capture_matrices(&c, camera->depth_zero_to_one, view, projection);
}

/* terrimp_camera_pixel_factor of a resolved camera. */
static float terrimpi_camera_pixel_factor(const terrimp_camera *camera)
{
    float sides[4], factor;
    terrimpi_camera_sides(camera, sides);
    factor = (float)camera->height_px / (sides[3] - sides[2]);
    return terrimpi_camera_has_sides(camera)
               ? terrimpi_max(factor, (float)camera->width_px / (sides[1] - sides[0]))
               : factor;
}

TERRIMP_API terrimp_result terrimp_camera_pixel_factor(const terrimp_camera *camera, float *factor)
{
    terrimp_camera c;
    TERRIMPI_REFUSE(!factor, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    *factor = terrimpi_camera_pixel_factor(&c);
    return TERRIMP_OK;
}

/* terrimp_camera_frustum of a resolved camera. A side's plane holds the eye, or runs along forward
   beside it. */
static void terrimpi_camera_frustum(const terrimp_camera *camera, terrimp_frustum *frustum)
{
    float sides[4], right[3], along = camera->orthographic ? 0.0f : 1.0f;
    int i, k;
    terrimpi_camera_sides(camera, sides);
    terrimpi_cross(camera->forward, camera->up, right);
    memcpy(frustum->eye, camera->eye, sizeof frustum->eye);
    for (k = 0; k < 6; k++) {
        const float *axis = k < 2 ? right : camera->up;
        float sign = k & 1 ? -1.0f : 1.0f, *plane = frustum->plane[k];
        for (i = 0; i < 3; i++)
            plane[i] = sign * (k < 4 ? axis[i] - camera->forward[i] * (along * sides[k])
                                     : camera->forward[i]);
        plane[3] = k < 4 ? (along - 1.0f) * sign * sides[k]
                         : -sign * (k == 4 ? camera->z_near : camera->z_far);
        if (camera->reach > 0.0f)
            plane[3] += camera->reach * terrimpi_length(plane);
    }
}

/* Where decisions about a resolved camera's picture of a box are made from; returns K there. About
   an orthographic one they are made from so far away that all directions to the box are alike to
   2^-16, and nothing in it, or about it by half its size, is farther than K counts with. */
static float terrimpi_camera_stand(const terrimp_camera *camera, const terrimp_box *all,
                                   float eye[3])
{
    float factor = terrimpi_camera_pixel_factor(camera), size, away;
    int i;
    memcpy(eye, camera->eye, sizeof camera->eye);
    if (!camera->orthographic)
        return factor;
    size = terrimp_box_farthest(all, all->min);
    away = terrimpi_min(65536.0f * size, 0.1f * TERRIMPI_CAMERA_FARTHEST);
    for (i = 0; i < 3; i++)
        eye[i] = all->min[i] + (all->max[i] - all->min[i]) * 0.5f - camera->forward[i] * away;
    return factor * (away + size);
}

TERRIMP_API terrimp_result terrimp_camera_frustum(const terrimp_camera *camera,
                                                  terrimp_frustum *frustum)
{
    terrimp_camera c;
    TERRIMPI_REFUSE(!frustum, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    terrimpi_camera_frustum(&c, frustum);
    return TERRIMP_OK;
}

TERRIMP_API int terrimp_frustum_test(const terrimp_frustum *frustum, const terrimp_box *box,
                                     int mask)
{
    int i, k, crossing = 0;
    for (i = 0; i < 6; i++) {
        const float *plane = frustum->plane[i];
        float most = plane[3], least = plane[3]; /* over the box's corners */
        if (!(mask & (1 << i)))
            continue;
        for (k = 0; k < 3; k++) {
            float a = plane[k] * (box->min[k] - frustum->eye[k]);
            float b = plane[k] * (box->max[k] - frustum->eye[k]);
            most += terrimpi_max(a, b);
            least += terrimpi_min(a, b);
        }
        if (most < 0.0f)
            return TERRIMP_PLANES_OUTSIDE;
        if (least < 0.0f)
            crossing |= 1 << i;
    }
    return crossing;
}

TERRIMP_API float terrimp_box_distance(const terrimp_box *box, const float point[3])
{
    float d[3];
    int i;
    for (i = 0; i < 3; i++)
        d[i] = terrimpi_max(0.0f,
                            terrimpi_max(box->min[i] - point[i], point[i] - box->max[i]));
    return terrimpi_length(d);
}

TERRIMP_API float terrimp_box_farthest(const terrimp_box *box, const float point[3])
{
    float d[3];
    int i;
    for (i = 0; i < 3; i++)
        d[i] = terrimpi_max(point[i] - box->min[i], box->max[i] - point[i]);
    return terrimpi_length(d);
}

/* Moves the sides of a box out. */
static void terrimpi_camera_grow(terrimp_box *box, float by)
{
    int i;
    for (i = 0; i < 3; i++) {
        box->min[i] -= by;
        box->max[i] += by;
    }
}

/* From the least to the largest depth of a box along a direction from an eye. */
static void terrimpi_camera_depths(const terrimp_box *box, const float eye[3],
                                   const float forward[3], float *first, float *last)
{
    int i;
    *first = *last = 0.0f;
    for (i = 0; i < 3; i++) {
        float f = forward[i];
        *first += f * ((f > 0.0f ? box->min[i] : box->max[i]) - eye[i]);
        *last += f * ((f > 0.0f ? box->max[i] : box->min[i]) - eye[i]);
    }
}

/* Corner i of a box (bit k of i: the maximum along axis k), relative to a point. */
static void terrimpi_camera_box_corner(const terrimp_box *box, int i, const float point[3],
                                       float corner[3])
{
    int k;
    for (k = 0; k < 3; k++)
        corner[k] = ((i >> k) & 1 ? box->max[k] : box->min[k]) - point[k];
}

/* Fits the sides and clip distances of a capture to points, with a hair's breadth more, so that
   rounding leaves none outside and a flat box has a volume. Returns 0 when the cosine between
   forward and the way to one of them is not above `least`, unless the capture is orthographic. */
static int terrimpi_camera_fit_sides(terrimp_capture *c, const float *xyz, uint32_t count,
                                     float least)
{
    float slope = 1.0f; /* of the steepest ray: its length over its depth */
    uint32_t i;
    c->z_near = c->tan_left = c->tan_down = TERRIMPI_FLOAT_MAX;
    c->z_far = c->tan_right = c->tan_up = -TERRIMPI_FLOAT_MAX;
    for (i = 0; i < count; i++) {
        float p[3], length, z, x, y;
        terrimpi_sub(xyz + 3u * i, c->eye, p);
        z = terrimpi_dot(c->forward, p);
        x = terrimpi_dot(c->right, p);
        y = terrimpi_dot(c->up, p);
        length = terrimpi_length(p);
        if (c->orthographic) {
            slope = terrimpi_max(slope, length);
        } else {
            if (!(z > least * length))
                return 0;
            slope = terrimpi_max(slope, length / z);
            x /= z;
            y /= z;
        }
        c->z_near = terrimpi_min(c->z_near, z);
        c->z_far = terrimpi_max(c->z_far, z);
        c->tan_left = terrimpi_min(c->tan_left, x);
        c->tan_right = terrimpi_max(c->tan_right, x);
        c->tan_down = terrimpi_min(c->tan_down, y);
        c->tan_up = terrimpi_max(c->tan_up, y);
    }
    if (c->orthographic) { /* of a flat box, too, there is a volume */
        c->z_near -= 1e-6f * slope;
        c->z_far += 1e-6f * slope;
    } else {
        c->z_near *= 1.0f - 1e-6f * slope;
        c->z_far *= 1.0f + 1e-6f * slope;
    }
    terrimpi_widen(&c->tan_left, &c->tan_right, slope);
    terrimpi_widen(&c->tan_down, &c->tan_up, slope);
    return 1;
}

/* As terrimp_capture_fit, but unchecked, and it may leave anything in *c on an error; orthographic
   and along forward where that is not NULL: then the eye is what its places are relative to. */
static terrimp_result terrimpi_camera_fit(const terrimp_box *box, const float eye[3],
                                          const float forward[3], terrimp_capture *c)
{
    static const float y_axis[3] = {0.0f, 1.0f, 0.0f}, minus_z[3] = {0.0f, 0.0f, -1.0f};
    static const float origin[3] = {0.0f, 0.0f, 0.0f};
    float corners[8][3];
    int i;
    TERRIMPI_REFUSE(!forward && terrimp_box_distance(box, eye) <= 0.0f, TERRIMP_E_INSIDE);
    c->orthographic = forward ? 1 : 0;
    for (i = 0; i < 3; i++) {
        c->eye[i] = eye[i];
        c->forward[i] = forward ? forward[i] : (box->min[i] - eye[i]) * 0.5f +
                                                   (box->max[i] - eye[i]) * 0.5f;
    }
    TERRIMPI_REFUSE(!terrimpi_normalize(c->forward), forward ? TERRIMP_E_RANGE : TERRIMP_E_INSIDE);
    memcpy(c->up, c->forward[1] * c->forward[1] > 0.9999f ? minus_z : y_axis, sizeof c->up);
    terrimpi_basis(c->forward, c->up, c->right);
    for (i = 0; i < 8; i++)
        terrimpi_camera_box_corner(box, i, origin, corners[i]);
    /* Beyond a slope of 1000 a perspective picture is of no use, and its numbers degrade. */
    return terrimpi_camera_fit_sides(c, corners[0], 8, 0.001f) ? TERRIMP_OK : TERRIMP_E_BEHIND;
}

TERRIMP_API terrimp_result terrimp_capture_fit(const terrimp_box *box, const float eye[3],
                                               terrimp_capture *capture)
{
    terrimp_capture c;
    TERRIMPI_REFUSE(!box || !eye || !capture, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(box->min) || !terrimpi_finite3(box->max) ||
                    !terrimpi_finite3(eye), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(box->min[0] > box->max[0] || box->min[1] > box->max[1] ||
                    box->min[2] > box->max[2] || terrimpi_largest(eye) > TERRIMPI_CAMERA_FARTHEST ||
                    terrimp_box_farthest(box, eye) > TERRIMPI_CAMERA_FARTHEST, TERRIMP_E_RANGE);
    TERRIMPI_TRY(terrimpi_camera_fit(box, eye, NULL, &c));
    *capture = c;
    return TERRIMP_OK;
}

/* Narrows a fitted capture to points, as the vertices that its picture is drawn on: its sides touch
   their projections, its clip distances stay. Returns 0 when a point is not in front of the eye. */
static int terrimpi_camera_tighten(terrimp_capture *c, const float *xyz, uint32_t count)
{
    float z_near = c->z_near, z_far = c->z_far;
    int fits = terrimpi_camera_fit_sides(c, xyz, count, 0.0f);
    c->z_near = z_near;
    c->z_far = z_far;
    return fits;
}

TERRIMP_API terrimp_result terrimp_capture_matrices(const terrimp_capture *capture,
                                                    int depth_zero_to_one, float view[16],
                                                    float projection[16])
{
    const terrimp_capture *c = capture;
    float width, height, depth, range; /* of clip depth */
    int i;
    TERRIMPI_REFUSE(!c || !view || !projection, TERRIMP_E_NULL);
    for (i = 0; i < 3; i++) {
        view[i * 4 + 0] = c->right[i];
        view[i * 4 + 1] = c->up[i];
        view[i * 4 + 2] = -c->forward[i];
        view[i * 4 + 3] = 0.0f;
    }
    view[12] = -terrimpi_dot(c->right, c->eye);
    view[13] = -terrimpi_dot(c->up, c->eye);
    view[14] = terrimpi_dot(c->forward, c->eye);
    view[15] = 1.0f;
    width = c->tan_right - c->tan_left;
    height = c->tan_up - c->tan_down;
    depth = c->z_far - c->z_near;
    range = depth_zero_to_one ? 1.0f : 2.0f;
    memset(projection, 0, 16 * sizeof *projection);
    projection[0] = 2.0f / width;
    projection[5] = 2.0f / height;
    if (c->orthographic) {
        projection[10] = -range / depth;
        projection[12] = -(c->tan_right + c->tan_left) / width;
        projection[13] = -(c->tan_up + c->tan_down) / height;
        projection[14] = -(depth_zero_to_one ? c->z_near : c->z_far + c->z_near) / depth;
        projection[15] = 1.0f;
        return TERRIMP_OK;
    }
    projection[8] = (c->tan_right + c->tan_left) / width;
    projection[9] = (c->tan_up + c->tan_down) / height;
    projection[10] = -1.0f; /* without a far plane */
    projection[11] = -1.0f;
    projection[14] = -range * c->z_near;
    if (c->z_far <= TERRIMPI_CAMERA_FARTHEST) {
        projection[10] = -(depth_zero_to_one ? c->z_far : c->z_far + c->z_near) / depth;
        projection[14] = -range * c->z_far * c->z_near / depth;
    }
    return TERRIMP_OK;
}

/* ==== Quadtree =========================================================== >>impl-quadtree */

static int terrimpi_tree_quads_fit(uint32_t quads)
{
    return quads >= 4u && quads <= 128u && quads % 2u == 0;
}

TERRIMP_API terrimp_result terrimp_quadtree_init(const terrimp_heightfield *field,
                                                 uint32_t chunk_quads, terrimp_quadtree *tree)
{
    terrimp_quadtree t;
    uint32_t x, z, level;
    TERRIMPI_REFUSE(!field || !tree, TERRIMP_E_NULL);
    memset(&t, 0, sizeof t);
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &t.field));
    t.chunk_quads = chunk_quads == 0 ? 64u : chunk_quads;
    TERRIMPI_REFUSE(!terrimpi_tree_quads_fit(t.chunk_quads), TERRIMP_E_RANGE);
    x = (t.field.width - 2u) / t.chunk_quads + 1u;
    z = (t.field.depth - 2u) / t.chunk_quads + 1u;
    for (level = 0;; level++) {
        TERRIMP_ASSERT(level < TERRIMP_QUADTREE_LEVELS);
        t.level_x[level] = x;
        t.level_z[level] = z;
        t.level_first[level + 1u] = t.level_first[level] + x * z;
        if (x == 1u && z == 1u)
            break;
        x = (x + 1u) / 2u;
        z = (z + 1u) / 2u;
    }
    t.level_count = level + 1u;
    t.node_count = t.level_first[t.level_count];
    *tree = t;
    return TERRIMP_OK;
}

/* ---- which node ---- */

static terrimp_node terrimpi_tree_at(const terrimp_quadtree *t, uint32_t level, uint32_t x,
                                     uint32_t z)
{
    terrimp_node n;
    n.number = t->level_first[level] + z * t->level_x[level] + x;
    n.level = level;
    n.x = x;
    n.z = z;
    return n;
}

static terrimp_node terrimpi_tree_node(const terrimp_quadtree *t, uint32_t number)
{
    uint32_t level = 0, k;
    while (number >= t->level_first[level + 1u])
        level++;
    k = number - t->level_first[level];
    return terrimpi_tree_at(t, level, k % t->level_x[level], k / t->level_x[level]);
}

static terrimp_node terrimpi_tree_root(const terrimp_quadtree *t)
{
    return terrimpi_tree_at(t, t->level_count - 1u, 0, 0);
}

static int terrimpi_tree_has(const terrimp_quadtree *t, uint32_t level, uint32_t x, uint32_t z)
{
    return x < t->level_x[level] && z < t->level_z[level];
}

/* The parent of a node that is not the root. */
static terrimp_node terrimpi_tree_parent(const terrimp_quadtree *t, const terrimp_node *n)
{
    return terrimpi_tree_at(t, n->level + 1u, n->x / 2u, n->z / 2u);
}

static uint32_t terrimpi_tree_parent_number(const terrimp_quadtree *t, uint32_t number)
{
    terrimp_node n = terrimpi_tree_node(t, number);
    return terrimpi_tree_parent(t, &n).number;
}

/* The node of the same level beyond a side; returns 0 where the terrain ends. */
static int terrimpi_tree_beyond(const terrimp_quadtree *t, const terrimp_node *n, int side,
                                terrimp_node *beyond)
{
    uint32_t step = side & 1 ? 1u : (uint32_t)-1; /* from 0 it leads to a number too large */
    uint32_t x = terrimpi_along_x(side) ? n->x : n->x + step;
    uint32_t z = terrimpi_along_x(side) ? n->z + step : n->z;
    if (!terrimpi_tree_has(t, n->level, x, z))
        return 0;
    *beyond = terrimpi_tree_at(t, n->level, x, z);
    return 1;
}

/* The child of a node in its quarter i, along x, then z. Returns 0 when there is none. */
static int terrimpi_tree_quarter(const terrimp_quadtree *t, const terrimp_node *n, uint32_t i,
                                 terrimp_node *child)
{
    uint32_t x = 2u * n->x + i % 2u, z = 2u * n->z + i / 2u;
    if (n->level == 0 || !terrimpi_tree_has(t, n->level - 1u, x, z))
        return 0;
    *child = terrimpi_tree_at(t, n->level - 1u, x, z);
    return 1;
}

/* ---- where it lies ---- */

/* Column and row of lattice position (i, j) of a level. */
static uint32_t terrimpi_tree_col(const terrimp_quadtree *t, uint32_t level, uint32_t i)
{
    return terrimpi_lattice(i, level, t->field.width - 1u);
}

static uint32_t terrimpi_tree_row(const terrimp_quadtree *t, uint32_t level, uint32_t j)
{
    return terrimpi_lattice(j, level, t->field.depth - 1u);
}

/* World x and z of lattice position (i, j) of a level. */
static float terrimpi_tree_x(const terrimp_quadtree *t, uint32_t level, uint32_t i)
{
    return terrimpi_field_line(t->field.origin_x, t->field.spacing_x,
                               terrimpi_tree_col(t, level, i));
}

static float terrimpi_tree_z(const terrimp_quadtree *t, uint32_t level, uint32_t j)
{
    return terrimpi_field_line(t->field.origin_z, t->field.spacing_z,
                               terrimpi_tree_row(t, level, j));
}

/* The box of a node whose heights are low to high. */
static void terrimpi_tree_box(const terrimp_quadtree *t, const terrimp_node *n, float low,
                              float high, terrimp_box *box)
{
    uint32_t i = n->x * t->chunk_quads, j = n->z * t->chunk_quads;
    box->min[0] = terrimpi_tree_x(t, n->level, i);
    box->max[0] = terrimpi_tree_x(t, n->level, i + t->chunk_quads);
    box->min[1] = low;
    box->max[1] = high;
    box->min[2] = terrimpi_tree_z(t, n->level, j);
    box->max[2] = terrimpi_tree_z(t, n->level, j + t->chunk_quads);
}

TERRIMP_API terrimp_result terrimp_quadtree_find(const terrimp_quadtree *tree, uint32_t level,
                                                 float x, float z, terrimp_node *node)
{
    uint32_t i, j;
    TERRIMPI_REFUSE(!tree || !node, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite2(x, z), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(level >= tree->level_count, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!terrimpi_field_locate(&tree->field, x, z, &i, &j), TERRIMP_E_MISS);
    *node = terrimpi_tree_at(tree, level, (i / tree->chunk_quads) >> level,
                             (j / tree->chunk_quads) >> level);
    return TERRIMP_OK;
}

/* ---- what is kept of it ---- */

#define TERRIMPI_PAGE_CHILDREN 56u /* where the records of the children stand in a page, */
#define TERRIMPI_PAGE_RECORD 44u   /* ... and how long a record is: it begins with the ground's */

/* A place for a page, see the room Residency. */
typedef struct terrimpi_page_slot {
    uint32_t node;      /* whose page it has or waits for; node_count: none */
    uint32_t used;      /* the last frame that had a use for it */
    const unsigned char *page; /* NULL: it has not come, or it is no good */
    uint8_t children;   /* nodes below that have a slot, */
    uint8_t lacking;    /* ... and those whose pages are not here */
    float record[TERRIMPI_PAGE_RECORD / sizeof(float)]; /* the page's own: what a frame looks at */
} terrimpi_page_slot;

struct terrimp_pages {
    terrimpi_page_slot *slots; /* [slot_count] */
    unsigned char *pages;      /* [slot_count][page_bytes] */
    unsigned char *header;     /* a copy */
    const unsigned char *root; /* the record of the root in it */
    const float *lows;         /* heights of the floor's vertices */
    uint16_t *slot_of;         /* [node_count] 1 + the slot of a node, 0: it has none */
    uint32_t slot_count, page_bytes, node_count;
    uint32_t frame, block_level, stamp;
    float morph_ratio;         /* of views, at most */
    float held[TERRIMP_QUADTREE_LEVELS]; /* of the last pages of a level, a running mean */
    int strays;                /* the view's walk may not come to all that it asks for */
    terrimp_want *wants;       /* [want_limit + 1] of this frame */
    uint32_t want_count, want_limit, want_first; /* first: of this update */
    const struct terrimpi_page_calls *calls;
};

struct terrimpi_mip_frame;
struct terrimpi_mip_ground;

/* Why a node is to be left for its children. */
typedef struct terrimpi_page_need {
    const terrimp_frustum *frustum;
    const float *eye;
    int reason;    /* terrimp_want_reason */
    float urgency; /* square of its error over the limit. 0: what is missing is not wanted */
    float reach;   /* square of the distance where that is 1; 0: nobody knows */
} terrimpi_page_need;

/* What pages do for a frame. It is called through what terrimp_pages_open sets, so that a host
   which opens none has no code of it. */
typedef struct terrimpi_page_calls {
    const unsigned char *(*record)(const terrimp_quadtree *t, uint32_t number);
    void (*begin)(const terrimp_quadtree *t);
    int (*want)(const terrimp_quadtree *t, uint32_t node, int reason, float urgency);
    int (*divides)(const terrimp_terrain *t, const terrimp_node *node,
                   const struct terrimpi_page_need *need);
    uint32_t (*settle)(const terrimp_terrain *t, struct terrimpi_mip_frame *mip, int strays);
    void (*look_ahead)(const terrimp_terrain *t, const struct terrimpi_mip_frame *mip,
                       const float away[3], float times);
    struct terrimpi_mip_ground (*ground)(const terrimp_quadtree *t, const terrimp_node *node);
    terrimp_result (*at)(const terrimp_quadtree *t, float x, float z, terrimp_heightfield *ground,
                         uint32_t *level);
    float (*sample)(const terrimp_quadtree *t, uint32_t x, uint32_t z);
} terrimpi_page_calls;

/* The page of a node, NULL when it is not here. */
static const unsigned char *terrimpi_page_of(const struct terrimp_pages *p, uint32_t node)
{
    uint32_t slot = p->slot_of[node];
    return slot ? p->slots[slot - 1u].page : NULL;
}

/* Notes that a page is of use in this frame, if it is here or coming. */
static void terrimpi_page_use(const struct terrimp_pages *p, uint32_t node)
{
    if (p->slot_of[node])
        p->slots[p->slot_of[node] - 1u].used = p->frame;
}

/* The record of a node whose page or whose parent's is here; else NULL. */
static const unsigned char *terrimpi_tree_record(const terrimp_quadtree *t, uint32_t number)
{
    uint32_t slot = t->pages->slot_of[number];
    return slot && t->pages->slots[slot - 1u].page
               ? (const unsigned char *)t->pages->slots[slot - 1u].record
               : t->pages->calls->record(t, number);
}

/* What PICTURE asks of a node for those below it: the last number of its record. */
static float terrimpi_page_held(const terrimp_quadtree *t, uint32_t number)
{
    return *(const float *)(const void *)(terrimpi_tree_record(t, number) + TERRIMPI_PAGE_RECORD -
                                          sizeof(float));
}

/* Heights and errors of a node. */
static const struct terrimp_geomip_node *terrimpi_tree_kept(const terrimp_quadtree *t,
                                                            uint32_t number)
{
    return t->nodes ? t->nodes + number
                    : (const struct terrimp_geomip_node *)(const void *)
                          terrimpi_tree_record(t, number);
}

/* Whether there is anything to be known of a tree's nodes. */
static int terrimpi_tree_is_built(const terrimp_quadtree *t) { return t->nodes || t->pages; }

/* Whether anything is known of a node's children. */
static int terrimpi_tree_opens(const terrimp_quadtree *t, uint32_t number)
{
    return !t->pages || terrimpi_page_of(t->pages, number);
}

/* ---- its children, closest first ---- */

/* The children of a node above level 0, in the order in which an eye comes upon them: none hides
   one before it. Returns how many there are. */
static uint32_t terrimpi_tree_children(const terrimp_quadtree *t, const terrimp_node *n,
                                       const float eye[3], terrimp_node children[4])
{
    uint32_t level = n->level - 1u, x = n->x * 2u, z = n->z * 2u, i, count = 0, first;
    first = (eye[0] >= terrimpi_tree_x(t, level, (x + 1u) * t->chunk_quads) ? 1u : 0u) |
            (eye[2] >= terrimpi_tree_z(t, level, (z + 1u) * t->chunk_quads) ? 2u : 0u);
    for (i = 0; i < 4u; i++) {
        uint32_t child_x = x + ((first ^ i) & 1u), child_z = z + ((first ^ i) >> 1);
        if (terrimpi_tree_has(t, level, child_x, child_z))
            children[count++] = terrimpi_tree_at(t, level, child_x, child_z);
    }
    return count;
}

/* A node on its way through the tree, and the planes that it has to be tested against. */
typedef struct terrimpi_tree_visit {
    terrimp_node node;
    int planes;
} terrimpi_tree_visit;

/* A walk from the root down, closest first: `next` takes a node, `enter` adds its children. The
   stack is enough for going down one child while the other three wait. */
typedef struct terrimpi_tree_walk {
    const terrimp_quadtree *tree;
    const float *eye;
    uint32_t depth;
    terrimpi_tree_visit stack[3u * TERRIMP_QUADTREE_LEVELS + 1u];
} terrimpi_tree_walk;

static void terrimpi_tree_begin(terrimpi_tree_walk *walk, const terrimp_quadtree *tree,
                                const float eye[3], int planes)
{
    walk->tree = tree;
    walk->eye = eye;
    walk->depth = 1;
    walk->stack[0].node = terrimpi_tree_root(tree);
    walk->stack[0].planes = planes;
}

/* Returns 0 at the end of the walk. */
static int terrimpi_tree_next(terrimpi_tree_walk *walk, terrimpi_tree_visit *visit)
{
    if (walk->depth == 0)
        return 0;
    *visit = walk->stack[--walk->depth];
    return 1;
}

/* The children of a node come next, to be tested against the planes that are left. */
static void terrimpi_tree_enter(terrimpi_tree_walk *walk, const terrimpi_tree_visit *visit)
{
    terrimp_node children[4];
    uint32_t count;
    if (visit->node.level == 0 || !terrimpi_tree_opens(walk->tree, visit->node.number))
        return;
    count = terrimpi_tree_children(walk->tree, &visit->node, walk->eye, children);
    while (count > 0) {
        walk->stack[walk->depth].node = children[--count];
        walk->stack[walk->depth++].planes = visit->planes;
    }
}

/* ==== Geomipmap ========================================================== >>impl-geomipmap */
/* Based on: de Boer 2000 (errors, distances, patterns, morphing); Wagner 2003 (strips, factors of
   the borders).

   Positions on the lattice of a level are (column, row) of the heightfield, cut off at its last
   column and row. All that two nodes share is computed from such positions, never from a node, so
   that both get the same floats. */

#define TERRIMPI_MIP_COLUMN 14u      /* 14 + 2 vertices: what a cache of 16 can hold of two rows */
#define TERRIMPI_MIP_MOST 1e30f      /* for squares that would overflow */
#ifndef TERRIMP_NO_MORPH
#define TERRIMPI_MIP_MORPH_MOST 4.0f
#else
#define TERRIMPI_MIP_MORPH_MOST 1.0f
#endif
#define TERRIMPI_MIP_PICTURE_QUAD 4.0f /* [px] with quads of this size PICTURE goes by rms alone */

/* ---- patterns ---- */

static int terrimpi_mip_form_fits(uint32_t quads, int form)
{
    return terrimpi_tree_quads_fit(quads) && form >= 0 && form < (int)TERRIMP_FORM_COUNT;
}

static uint32_t terrimpi_mip_columns(uint32_t quads)
{
    return (quads + TERRIMPI_MIP_COLUMN - 1u) / TERRIMPI_MIP_COLUMN;
}

/* First quad of a column: columns are as equally wide as can be. */
static uint32_t terrimpi_mip_column(uint32_t quads, uint32_t column)
{
    return quads * column / terrimpi_mip_columns(quads);
}

/* Triangles that fetch the first row of a column in a list. */
static uint32_t terrimpi_mip_ahead(uint32_t quads, uint32_t column)
{
    return (terrimpi_mip_column(quads, column + 1u) - terrimpi_mip_column(quads, column) + 2u) / 2u;
}

static uint32_t terrimpi_mip_coarse_sides(uint32_t pattern)
{
    return (pattern & 1u) + (pattern >> 1 & 1u) + (pattern >> 2 & 1u) + (pattern >> 3 & 1u);
}

/* Each border vertex that is left out takes one triangle with it. */
static uint32_t terrimpi_mip_triangles(uint32_t quads, uint32_t pattern)
{
    return 2u * quads * quads - quads / 2u * terrimpi_mip_coarse_sides(pattern);
}

static uint32_t terrimpi_mip_indices(uint32_t quads, int form, uint32_t pattern)
{
    uint32_t column, ahead = 0, triangles = terrimpi_mip_triangles(quads, pattern);
    if (form == TERRIMP_FORM_STRIP) /* each row: its zigzag and two indices to join the next */
        return (quads + 1u) * (2u * quads + 4u * terrimpi_mip_columns(quads)) - 1u;
    for (column = 0; column < terrimpi_mip_columns(quads); column++)
        ahead += terrimpi_mip_ahead(quads, column);
    return 3u * (triangles + ahead);
}

TERRIMP_API terrimp_result terrimp_pattern_find(uint32_t chunk_quads, int form, uint32_t pattern,
                                                terrimp_pattern *found)
{
    uint32_t i, first = 0;
    TERRIMPI_REFUSE(!found, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_mip_form_fits(chunk_quads, form) || pattern >= TERRIMP_PATTERN_COUNT,
                    TERRIMP_E_RANGE);
    for (i = 0; i < pattern; i++)
        first += terrimpi_mip_indices(chunk_quads, form, i);
    found->first_index = first;
    found->index_count = terrimpi_mip_indices(chunk_quads, form, pattern);
    found->triangle_count = terrimpi_mip_triangles(chunk_quads, pattern);
    return TERRIMP_OK;
}

TERRIMP_API uint32_t terrimp_pattern_index_count(uint32_t chunk_quads, int form)
{
    terrimp_pattern last;
    if (terrimp_pattern_find(chunk_quads, form, TERRIMP_PATTERN_COUNT - 1u, &last) != TERRIMP_OK)
        return 0;
    return last.first_index + last.index_count;
}

/* Writes one pattern. */
typedef struct terrimpi_mip_writer {
    uint32_t quads, pattern;
    int form;
    uint16_t *start, *out;
} terrimpi_mip_writer;

/* The index of vertex (i, j), or of the one that it is moved to when a coarse side leaves it out:
   towards -x on +z, towards +z on -x and so on, which keeps the diagonal of every coarse quad an
   edge. */
static uint16_t terrimpi_mip_index(const terrimpi_mip_writer *w, uint32_t i, uint32_t j)
{
    int side;
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        int along_x = terrimpi_along_x(side), last = side & 1;
        uint32_t *along = along_x ? &i : &j;
        if ((w->pattern >> side & 1u) && (along_x ? j : i) == (last ? w->quads : 0u) &&
            (*along & 1u))
            *along = last ? *along - 1u : *along + 1u;
    }
    return (uint16_t)(j * (w->quads + 1u) + i);
}

static void terrimpi_mip_triangle(terrimpi_mip_writer *w, uint16_t a, uint16_t b, uint16_t c)
{
    if (a == b || b == c || c == a)
        return;
    *w->out++ = a;
    *w->out++ = b;
    *w->out++ = c;
}

/* A column of quads as a list. Rows run from +x to -x, so that a quad's diagonal needs no vertex
   that has just been pushed out of a cache of 16. */
static void terrimpi_mip_list_column(terrimpi_mip_writer *w, uint32_t from, uint32_t to)
{
    uint32_t i, j;
    for (i = to + 1u; i-- > from;) { /* fetch row 0, two vertices a triangle */
        *w->out++ = terrimpi_mip_index(w, i, 0);
        if (i > from)
            i--;
        *w->out++ = terrimpi_mip_index(w, i, 0);
        *w->out++ = terrimpi_mip_index(w, i, 0);
    }
    for (j = 0; j < w->quads; j++)
        for (i = to; i-- > from;) {
            uint16_t a = terrimpi_mip_index(w, i, j), b = terrimpi_mip_index(w, i, j + 1u);
            uint16_t c = terrimpi_mip_index(w, i + 1u, j + 1u);
            terrimpi_mip_triangle(w, a, c, terrimpi_mip_index(w, i + 1u, j));
            terrimpi_mip_triangle(w, a, b, c);
        }
}

/* One zigzag between rows j and k of a column (k == j fetches the row), joined to what was written
   before: an odd number of indices, so that each row's first triangle winds the right way. */
static void terrimpi_mip_strip_row(terrimpi_mip_writer *w, uint32_t from, uint32_t to, uint32_t j,
                                   uint32_t k)
{
    uint32_t i;
    if (w->out != w->start) {
        *w->out = w->out[-1];
        w->out++;
    }
    *w->out++ = terrimpi_mip_index(w, to, j);
    for (i = to + 1u; i-- > from;) {
        *w->out++ = terrimpi_mip_index(w, i, j);
        *w->out++ = terrimpi_mip_index(w, i, k);
    }
}

static void terrimpi_mip_fill_pattern(terrimpi_mip_writer *w)
{
    uint32_t column, j;
    w->start = w->out;
    for (column = 0; column < terrimpi_mip_columns(w->quads); column++) {
        uint32_t from = terrimpi_mip_column(w->quads, column);
        uint32_t to = terrimpi_mip_column(w->quads, column + 1u);
        if (w->form != TERRIMP_FORM_STRIP) {
            terrimpi_mip_list_column(w, from, to);
            continue;
        }
        terrimpi_mip_strip_row(w, from, to, 0, 0);
        for (j = 0; j < w->quads; j++)
            terrimpi_mip_strip_row(w, from, to, j, j + 1u);
    }
}

TERRIMP_API terrimp_result terrimp_pattern_fill(uint32_t chunk_quads, int form, uint16_t *indices,
                                                size_t capacity)
{
    terrimpi_mip_writer w;
    uint32_t count = terrimp_pattern_index_count(chunk_quads, form);
    TERRIMPI_REFUSE(!indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(count == 0, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(capacity < count, TERRIMP_E_CAPACITY);
    w.quads = chunk_quads;
    w.form = form;
    w.out = indices;
    for (w.pattern = 0; w.pattern < TERRIMP_PATTERN_COUNT; w.pattern++)
        terrimpi_mip_fill_pattern(&w);
    return TERRIMP_OK;
}

/* ---- boxes ---- */

static void terrimpi_mip_box(const terrimp_quadtree *t, const terrimp_node *n, terrimp_box *box)
{
    const terrimp_geomip_node *kept = terrimpi_tree_kept(t, n->number);
    TERRIMP_ASSERT(kept);
    terrimpi_tree_box(t, n, kept->low, kept->high, box);
}

/* The box within which a node's error holds: half a quad larger all round, for what finer
   neighbours draw up to it. */
static void terrimpi_mip_error_box(const terrimp_quadtree *t, const terrimp_node *n,
                                   terrimp_box *box)
{
    float half = 0.5f * (float)(1u << n->level);
    terrimpi_mip_box(t, n, box);
    box->min[0] -= half * t->field.spacing_x;
    box->max[0] += half * t->field.spacing_x;
    box->min[2] -= half * t->field.spacing_z;
    box->max[2] += half * t->field.spacing_z;
}

TERRIMP_API terrimp_result terrimp_geomip_box(const terrimp_quadtree *tree, uint32_t node,
                                              terrimp_box *box)
{
    terrimp_node n;
    TERRIMPI_REFUSE(!tree || !box || !terrimpi_tree_is_built(tree), TERRIMP_E_NULL);
    TERRIMPI_REFUSE(node >= tree->node_count, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!terrimpi_tree_kept(tree, node), TERRIMP_E_PAGE);
    n = terrimpi_tree_node(tree, node);
    terrimpi_mip_box(tree, &n, box);
    return TERRIMP_OK;
}

/* ---- heights ---- */

/* Height on the edge from a to b, k of n steps along it; exact at its ends. */
static float terrimpi_mip_between(float a, float b, uint32_t k, uint32_t n)
{
    return k == 0 ? a : k == n ? b : a + (b - a) * ((float)k / (float)n);
}

/* Where the samples of ground are: in the tree's field; or in the page of a node, of a level, from
   its column i0 and row j0 on, quads + 1 along a side. */
typedef struct terrimpi_mip_ground {
    const terrimp_quadtree *tree;
    terrimp_heightfield field;
    uint32_t level, i0, j0, quads;
} terrimpi_mip_ground;

static terrimpi_mip_ground terrimpi_mip_ground_of(const terrimp_quadtree *t)
{
    terrimpi_mip_ground g;
    g.tree = t;
    g.field = t->field;
    g.level = g.i0 = g.j0 = 0;
    g.quads = TERRIMP_MAX_DIM;
    return g;
}

/* A sample of the tree's field; one beyond a page is of no consequence. */
static float terrimpi_mip_sample(const terrimpi_mip_ground *g, uint32_t x, uint32_t z)
{
    uint32_t part = (1u << g->level) - 1u; /* the last ones may be closer */
    return terrimpi_field_sample(
        &g->field, terrimpi_min_u32(((x + part) >> g->level) - g->i0, g->quads),
        terrimpi_min_u32(((z + part) >> g->level) - g->j0, g->quads));
}

/* Height of the triangles of a level at a sample. */
static float terrimpi_mip_height(const terrimpi_mip_ground *g, uint32_t level, uint32_t x,
                                 uint32_t z)
{
    const terrimp_quadtree *t = g->tree;
    uint32_t i = x >> level, j = z >> level;
    uint32_t x0 = terrimpi_tree_col(t, level, i), x1 = terrimpi_tree_col(t, level, i + 1u);
    uint32_t z0 = terrimpi_tree_row(t, level, j), z1 = terrimpi_tree_row(t, level, j + 1u);
    float a = terrimpi_mip_sample(g, x0, z0), b, c, u, v;
    float d = terrimpi_mip_sample(g, x1, z1);
    uint32_t wide = x1 - x0, deep = z1 - z0, right, down;
    right = x - x0;
    down = z - z0;
    if (wide == 0 || deep == 0 || right * deep == down * wide) /* an edge of the far sides, or the
                                                                  diagonal */
        return wide == 0 ? terrimpi_mip_between(a, d, down, deep ? deep : 1u)
                         : terrimpi_mip_between(a, d, right, wide);
    b = terrimpi_mip_sample(g, x1, z0);
    c = terrimpi_mip_sample(g, x0, z1);
    if (right == 0)
        return terrimpi_mip_between(a, c, down, deep);
    if (down == 0)
        return terrimpi_mip_between(a, b, right, wide);
    u = (float)right / (float)wide;
    v = (float)down / (float)deep;
    return u < v ? a + v * (c - a) + u * (d - c) : a + u * (b - a) + v * (d - b);
}

/* ---- selection ---- */

/* One frame's selection. A point r from the eye, at depth z = forward . r, that is moved by e along
   y appears K e |forward x (y x r)| / (z z') pixels off, z' being its depth after the move. With p
   and q the parts of r along and across the horizontal heading, and forward = (heading * level,
   steep), the product's length is sqrt(p^2 + (steep q)^2). */
typedef struct terrimpi_mip_frame {
    const terrimp_quadtree *tree;
    terrimp_geomip_view *view;
    terrimp_frustum frustum;
    float eye[3], forward[3];
    float reach;               /* of the camera */
    float heading[2];          /* x, z; unit length */
    float level, steep;
    float along, across;       /* largest tangents on the screen, in the direction in which y is
                                  seen there, and across it */
    float cos2;                /* square of the cosine between forward and the screen's corner */
    const terrimp_bound *bound; /* for that rule; else NULL */
    float relief;              /* what measures are multiplied with */
    float whole;               /* [wu] so close to the eye all is split; below 0: all in sight */
    float factor;              /* pixels that errors count in */
    uint32_t first[TERRIMP_QUADTREE_LEVELS]; /* lists of marks; ends with node_count */
} terrimpi_mip_frame;

/* What only BOUND needs: what follows from the camera, and what D^2 is to be multiplied with. */
struct terrimp_bound {
    void (*begin)(terrimpi_mip_frame *f, const terrimp_camera *camera, float tan_x, float tan_y);
    float (*factor)(const terrimpi_mip_frame *f, const terrimp_box *box, float distance2);
};

/* Sets up what depends on the camera alone. The screen is taken larger by the tolerance: a sample
   at its edge may be drawn that far outside. */
static void terrimpi_mip_set_camera(terrimpi_mip_frame *f, const terrimp_camera *camera,
                                    float margin)
{
    float tan_x = 0.0f, tan_y = 0.0f;
    if (camera->orthographic)
        margin = 1.0f / 65536.0f; /* see terrimpi_camera_stand */
    else
        terrimpi_camera_tangents(camera, &tan_x, &tan_y);
    tan_x += margin;
    tan_y += margin;
    f->reach = camera->reach;
    f->cos2 = 1.0f / (1.0f + tan_x * tan_x + tan_y * tan_y);
    if (f->bound)
        f->bound->begin(f, camera, tan_x, tan_y);
}

static void terrimpi_mip_bound_begin(terrimpi_mip_frame *f, const terrimp_camera *camera,
                                     float tan_x, float tan_y)
{
    float right[3], seen[3], aside[3];
    terrimpi_cross(camera->forward, camera->up, right);
    memcpy(f->forward, camera->forward, sizeof f->forward);
    f->steep = f->forward[1];
    f->level = TERRIMP_SQRTF(f->forward[0] * f->forward[0] + f->forward[2] * f->forward[2]);
    if (f->level > 1e-6f) {
        f->heading[0] = f->forward[0] / f->level;
        f->heading[1] = f->forward[2] / f->level;
    } else { /* straight up or down: any heading will do */
        f->heading[0] = 1.0f;
        f->heading[1] = 0.0f;
    }
    seen[0] = -f->steep * f->heading[0];
    seen[1] = f->level;
    seen[2] = -f->steep * f->heading[1];
    terrimpi_cross(f->forward, seen, aside);
    f->along = tan_x * terrimpi_abs(terrimpi_dot(seen, right)) +
               tan_y * terrimpi_abs(terrimpi_dot(seen, camera->up));
    f->across = tan_x * terrimpi_abs(terrimpi_dot(aside, right)) +
                tan_y * terrimpi_abs(terrimpi_dot(aside, camera->up));
}

/* Square of the distance from the eye to the closest point of a box. */
static float terrimpi_mip_distance2(const terrimp_box *box, const float eye[3])
{
    float sum = 0.0f;
    int k;
    for (k = 0; k < 3; k++) {
        float d = terrimpi_max(box->min[k] - eye[k], eye[k] - box->max[k]);
        sum += d > 0.0f ? d * d : 0.0f;
    }
    return sum;
}

/* A bound of |p| / z over what the screen shows of a box whose depths are within z_min..z_max and
   whose highest point (looking down; else the lowest) is `top` above (below) the eye. Since
   z = level p - steep y, p / z is (1 + steep y / z) / level. */
static float terrimpi_mip_stretch(const terrimpi_mip_frame *f, float p_min, float p_max, float top,
                                  float z_min, float z_max)
{
    float steep = terrimpi_abs(f->steep), most = f->level + steep * f->along, behind;
    if (f->level > 1e-3f)
        most = terrimpi_min(most, (1.0f + steep * top / (top > 0.0f ? z_min : z_max)) / f->level);
    most = terrimpi_min(most, p_max / z_min);
    behind = terrimpi_min(steep * f->along - f->level, -p_min / z_min);
    return terrimpi_max(terrimpi_max(most, behind), 0.0f);
}

/* The square of the most pixels that a vertical error of K^-1 shows as anywhere in a box. It
   changes continuously with the camera, and never grows from a box to a part of it. */
static float terrimpi_mip_bound_factor(const terrimpi_mip_frame *f, const terrimp_box *box,
                                       float distance2)
{
    float c[3], h[3], p, p_half, q_most, z, z2, far2 = 0.0f, a, b;
    int k;
    for (k = 0; k < 3; k++) {
        float low = box->min[k] - f->eye[k], high = box->max[k] - f->eye[k];
        c[k] = 0.5f * (low + high);
        h[k] = 0.5f * (high - low);
        far2 += terrimpi_max(low * low, high * high);
    }
    z = terrimpi_dot(f->forward, c);
    for (k = 0; k < 3; k++)
        z -= terrimpi_abs(f->forward[k]) * h[k];
    p = f->heading[0] * c[0] + f->heading[1] * c[2];
    p_half = terrimpi_abs(f->heading[0]) * h[0] + terrimpi_abs(f->heading[1]) * h[2];
    q_most = terrimpi_abs(f->heading[1] * c[0] - f->heading[0] * c[2]) +
             terrimpi_abs(f->heading[1]) * h[0] + terrimpi_abs(f->heading[0]) * h[2];
    z2 = terrimpi_max(z > 0.0f ? z * z : 0.0f, distance2 * f->cos2);
    a = terrimpi_mip_stretch(f, p - p_half, p + p_half,
                             f->steep <= 0.0f ? c[1] + h[1] : h[1] - c[1], TERRIMP_SQRTF(z2),
                             TERRIMP_SQRTF(far2));
    b = terrimpi_min(f->across * f->across, q_most * q_most / z2) * f->steep * f->steep;
    return (a * a + b) / z2 * 1.00001f; /* more than all rounding here */
}

TERRIMP_API const terrimp_bound *terrimp_geomip_bound(void)
{
    static const terrimp_bound calls = {terrimpi_mip_bound_begin, terrimpi_mip_bound_factor};
    return &calls;
}

/* D of one node, squared, before its children have a say. */
static float terrimpi_mip_distance(const terrimpi_mip_frame *f, uint32_t level, uint32_t node)
{
    const terrimp_quadtree *t = f->tree;
    float d;
    if (level == 0)
        return 0.0f;
    if (f->view->rule != TERRIMP_GEOMIP_PICTURE) {
        /* Rounding of heights and of the error itself, so that the bound is one. */
        const terrimp_geomip_node *n = terrimpi_tree_kept(t, node);
        float size = terrimpi_max(terrimpi_abs(n->low), terrimpi_abs(n->high));
        d = n->error > 0.0f ? n->error + 5e-7f * size : 0.0f;
        d *= f->factor / f->view->tolerance_px;
        d *= d;
    } else {
        /* The picture's error is its area times the square of the displacement. All nodes cost the
           same triangles; so what a split gains goes with (rms * K / d)^2 * (quad * K / d)^2, and
           is equal over all nodes where rms * quad / d^2 is. */
        float quad = 0.5f * (t->field.spacing_x + t->field.spacing_z) * (float)(1u << level);
        float rms = t->pages ? terrimpi_page_held(t, node) : t->nodes[node].rms;
        d = rms * f->factor * (quad * f->factor) /
            (f->view->tolerance_px * TERRIMPI_MIP_PICTURE_QUAD);
    }
    return terrimpi_min(d, TERRIMPI_MIP_MOST);
}

/* Square of a node's error over the tolerance, when it is drawn as it is; 0 when it is out of view.
   *planes: those to test against, and those that are left for its parts. */
static float terrimpi_mip_split_ratio(const terrimpi_mip_frame *f, const terrimp_node *node,
                                      int *planes)
{
    float d2, measure, split2;
    terrimp_box box;
    split2 = f->tree->pages ? terrimpi_mip_distance(f, node->level, node->number)
                            : f->view->distances[node->number];
    if (!(split2 > 0.0f) && !(f->whole > 0.0f) && !(f->whole < 0.0f))
        return 0.0f;
    terrimpi_mip_error_box(f->tree, node, &box);
    if (f->whole > 0.0f && terrimpi_mip_distance2(&box, f->eye) < f->whole * f->whole)
        return TERRIMPI_MIP_MOST;
    if (*planes) {
        *planes = terrimp_frustum_test(&f->frustum, &box, *planes);
        if (*planes == TERRIMP_PLANES_OUTSIDE)
            return 0.0f;
    }
    if (f->whole < 0.0f)
        return TERRIMPI_MIP_MOST;
    if (split2 >= TERRIMPI_MIP_MOST)
        return split2; /* at no distance; or it cannot be drawn at all */
    terrimpi_camera_grow(&box, f->reach);
    d2 = terrimpi_mip_distance2(&box, f->eye);
    split2 *= f->relief;
    measure = f->bound ? split2 * f->bound->factor(f, &box, d2) : split2 / d2;
    return measure < TERRIMPI_MIP_MOST ? measure : TERRIMPI_MIP_MOST; /* NaN: split it */
}

/* Raises a node's measure, and enters the node into the list of its level. */
static void terrimpi_mip_enter(terrimpi_mip_frame *f, const terrimp_node *node, float measure)
{
    terrimp_geomip_mark *mark = &f->view->marks[node->number];
    if (mark->frame != f->view->frame) {
        mark->frame = f->view->frame;
        mark->measure = 0.0f;
        mark->next = f->first[node->level];
        f->first[node->level] = node->number;
    }
    mark->measure = terrimpi_max(mark->measure, measure);
}

/* The measure that a node was given in this frame; less than 1: not split. */
static float terrimpi_mip_ratio_of(const terrimpi_mip_frame *f, uint32_t node)
{
    const terrimp_geomip_mark *mark = &f->view->marks[node];
    return mark->frame == f->view->frame ? mark->measure : 0.0f;
}

/* Marks the nodes whose own error asks for a split, and those that are close to it. Measures never
   grow towards the leaves, so what lies below an unsplit node asks for nothing. What is out of view
   asks for nothing either, unless nodes morph: then a border would jump when one of its nodes
   leaves the view. */
static void terrimpi_mip_mark_errors(terrimpi_mip_frame *f)
{
    terrimpi_tree_walk walk;
    terrimpi_tree_visit v;
    float stay = 1.0f + f->view->hysteresis;
    float worth = 1.0f / (f->view->morph_ratio * f->view->morph_ratio);
    terrimpi_tree_begin(&walk, f->tree, f->eye, worth < 1.0f ? 0 : TERRIMP_PLANES_ALL);
    while (terrimpi_tree_next(&walk, &v)) {
        const terrimp_geomip_mark *mark = &f->view->marks[v.node.number];
        float measure = v.node.level == 0 ? 0.0f : terrimpi_mip_split_ratio(f, &v.node, &v.planes);
        if (mark->frame == f->view->frame - 1u && terrimpi_abs(mark->measure) >= 1.0f &&
            worth >= 1.0f)
            measure *= stay * stay;
        if (measure < worth)
            continue;
        terrimpi_mip_enter(f, &v.node, measure);
        if (measure >= 1.0f && v.node.level > 1u)
            terrimpi_tree_enter(&walk, &v);
    }
}

/* Sees to it that neighbours differ by one level at most. A node that is split has children beside
   the neighbours of its own level, which have to exist: their parents are split. What is raised is
   always one level up, so one pass from the finest level to the root settles everything. The parent
   of a node that is raised needs no care: it is also the parent of the raising node's parent, or a
   neighbour's parent to that, and so measures morph_ratio^2 times more; as all parents do of their
   children, which lets nodes cease to morph before they split. */
static void terrimpi_mip_balance(terrimpi_mip_frame *f)
{
    const terrimp_quadtree *t = f->tree;
    uint32_t level, number;
    int side;
    for (level = 1; level + 1u < t->level_count; level++)
        for (number = f->first[level]; number != t->node_count;
             number = f->view->marks[number].next) {
            terrimp_node node = terrimpi_tree_node(t, number), beyond;
            for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
                if (terrimpi_tree_beyond(t, &node, side, &beyond)) {
                    terrimp_node parent = terrimpi_tree_parent(t, &beyond);
                    terrimpi_mip_enter(f, &parent, f->view->marks[number].measure);
                }
        }
}

/* How far a node has morphed into the shape of its parent, from the parent's measure: from 1 where
   the parent splits to 0 at morph_ratio times less distance, linear in the distance. */
static float terrimpi_mip_fraction(const terrimpi_mip_frame *f, const terrimp_node *node)
{
    float ratio = f->view->morph_ratio, measure;
    if (TERRIMPI_MIP_MORPH_MOST <= 1.0f || !(ratio > 1.0f) ||
        node->level + 1u >= f->tree->level_count)
        return 0.0f;
    measure = terrimpi_mip_ratio_of(f, terrimpi_tree_parent(f->tree, node).number);
    if (measure >= ratio * ratio)
        return 0.0f;
    return measure > 1.0f ? (ratio / TERRIMP_SQRTF(measure) - 1.0f) / (ratio - 1.0f) : 1.0f;
}

/* What a node's side needs: whether the neighbour is coarser, and the factors of the border. With a
   neighbour of the same level the larger fraction holds for both; a coarser neighbour dictates. */
static void terrimpi_mip_side(const terrimpi_mip_frame *f, int side, terrimp_geomip_draw *draw)
{
    const terrimp_node *node = &draw->node;
    terrimp_node beyond, parent;
    draw->side[side] = draw->morph;
    draw->side_coarse[side] = 0.0f;
    if (!terrimpi_tree_beyond(f->tree, node, side, &beyond))
        return;
    parent = terrimpi_tree_parent(f->tree, &beyond);
    if (parent.x == node->x / 2u && parent.z == node->z / 2u)
        return; /* a sibling, or its children: the same fraction, or 0 */
    if (terrimpi_mip_ratio_of(f, parent.number) < 1.0f) {
        draw->pattern |= 1u << side;
        draw->side_coarse[side] = terrimpi_mip_fraction(f, &parent);
        draw->side[side] = 1.0f; /* they are left out */
    } else {
        draw->side[side] = terrimpi_max(draw->morph, terrimpi_mip_fraction(f, &beyond));
    }
}

static void terrimpi_mip_emit(terrimpi_mip_frame *f, const terrimp_node *node)
{
    terrimp_geomip_view *v = f->view;
    terrimp_geomip_draw *draw;
    int side, planes = 0;
    if (v->draws_needed++ >= v->draw_capacity)
        return;
    draw = &v->draws[v->draws_needed - 1u];
    draw->node = *node;
    draw->pattern = 0;
    draw->error_px = 0.0f;
    if (node->level > 0)
        draw->error_px = v->tolerance_px * TERRIMP_SQRTF(terrimpi_mip_split_ratio(f, node,
                                                                                  &planes));
    draw->morph = terrimpi_mip_fraction(f, node);
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
        terrimpi_mip_side(f, side, draw);
    v->triangle_count += terrimpi_mip_triangles(f->tree->chunk_quads, draw->pattern);
}

/* Walks down to the nodes that are not split, children closest to the eye first, and leaves out
   what the frustum does not meet. Wagner's ground rectangle of the frustum, as an early out here
   and above, was measured and left out: 0.042 against 0.045 ms a frame, which is noise. */
static void terrimpi_mip_collect(terrimpi_mip_frame *f)
{
    terrimpi_tree_walk walk;
    terrimpi_tree_visit v;
    f->view->draws_needed = f->view->triangle_count = 0;
    terrimpi_tree_begin(&walk, f->tree, f->eye, TERRIMP_PLANES_ALL);
    while (terrimpi_tree_next(&walk, &v)) {
        if (v.planes) {
            terrimp_box box;
            terrimpi_mip_box(f->tree, &v.node, &box);
            v.planes = terrimp_frustum_test(&f->frustum, &box, v.planes);
            if (v.planes == TERRIMP_PLANES_OUTSIDE)
                continue;
        }
        if (v.node.level == 0 || terrimpi_mip_ratio_of(f, v.node.number) < 1.0f)
            terrimpi_mip_emit(f, &v.node);
        else
            terrimpi_tree_enter(&walk, &v);
    }
}

/* Remakes the distances when what they depend on has changed; a parent's are at least what its
   children ask for. */
static void terrimpi_mip_refresh(terrimpi_mip_frame *f, float pixel_factor)
{
    terrimp_geomip_view *v = f->view;
    terrimp_node n;
    float wanted[5];
    wanted[0] = (float)v->rule;
    wanted[1] = v->tolerance_px;
    wanted[2] = v->morph_ratio;
    wanted[3] = v->rule == TERRIMP_GEOMIP_DISTANCE ? pixel_factor / f->cos2 : pixel_factor;
    wanted[4] = 1.0f + (float)(f->tree->edits & 0xffffffu);
    f->factor = wanted[3];
    if (f->tree->pages || /* they say what those below ask of them */
        memcmp(wanted, v->distances_for, sizeof wanted) == 0)
        return;
    memcpy(v->distances_for, wanted, sizeof wanted);
    for (n.level = n.number = 0; n.level < f->tree->level_count; n.level++)
        for (; n.number < f->tree->level_first[n.level + 1u]; n.number++)
            v->distances[n.number] = terrimpi_mip_distance(f, n.level, n.number);
    for (n.number = 0; n.number + 1u < f->tree->node_count; n.number++) {
        float least = v->distances[n.number] * v->morph_ratio * v->morph_ratio;
        float *d = &v->distances[terrimpi_tree_parent_number(f->tree, n.number)];
        *d = terrimpi_max(*d, terrimpi_min(least, TERRIMPI_MIP_MOST));
    }
}

/* Fills in a view's defaults, in a copy, and checks it. */
static terrimp_result terrimpi_mip_view_resolve(const terrimp_quadtree *tree,
                                                terrimp_geomip_view *view)
{
    TERRIMPI_DEFAULT(view->rule, TERRIMP_GEOMIP_PICTURE);
    TERRIMPI_DEFAULT(view->tolerance_px, 1.0f);
    TERRIMPI_DEFAULT(view->morph_ratio, 1.0f);
    TERRIMPI_REFUSE(!view->distances || !view->marks || !view->draws ||
                    !terrimpi_tree_is_built(tree), TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite2(view->tolerance_px, view->morph_ratio) ||
                    !terrimpi_finite(view->hysteresis), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(view->rule < 0 || view->rule >= (int)TERRIMP_GEOMIP_RULE_COUNT ||
                    !terrimpi_within(view->tolerance_px, 0.01f, 1000.0f) ||
                    !terrimpi_within(view->morph_ratio, 1.0f, TERRIMPI_MIP_MORPH_MOST) ||
                    !terrimpi_within(view->hysteresis, 0.0f, 1.0f), TERRIMP_E_RANGE);
    return TERRIMP_OK;
}

/* Decides which nodes are split, at a tolerance that is `scale` times as large as the view's: the
   distances stay. Settings and camera are resolved. */
static void terrimpi_mip_mark(terrimpi_mip_frame *f, const terrimp_quadtree *tree,
                              terrimp_geomip_view *view, const terrimp_camera *camera, float scale)
{
    terrimp_node root = terrimpi_tree_root(tree);
    float pixel_factor;
    terrimp_box all;
    uint32_t level;
    terrimpi_mip_box(tree, &root, &all);
    pixel_factor = terrimpi_camera_stand(camera, &all, f->eye);
    terrimpi_camera_frustum(camera, &f->frustum);
    f->tree = tree;
    f->view = view;
    f->relief = view->rule == TERRIMP_GEOMIP_PICTURE ? 1.0f / scale : 1.0f / (scale * scale);
    for (level = 0; level < tree->level_count; level++)
        f->first[level] = tree->node_count;
    terrimpi_mip_set_camera(f, camera, view->tolerance_px * scale / pixel_factor);
    terrimpi_mip_refresh(f, pixel_factor);
    view->frame = view->frame + 1u == 0 ? 1u : view->frame + 1u; /* 0 is what fresh marks say */
    terrimpi_mip_mark_errors(f);
    terrimpi_mip_balance(f);
}

/* terrimp_geomip_select with resolved settings and camera. */
static terrimp_result terrimpi_mip_select(const terrimp_quadtree *tree, terrimp_geomip_view *view,
                                          const terrimp_camera *camera)
{
    terrimpi_mip_frame f;
    f.whole = 0.0f;
    f.bound = view->rule == TERRIMP_GEOMIP_BOUND ? terrimp_geomip_bound() : NULL;
    terrimpi_mip_mark(&f, tree, view, camera, 1.0f);
    terrimpi_mip_collect(&f);
    view->draw_count = view->draws_needed;
    if (view->draws_needed <= view->draw_capacity)
        return TERRIMP_OK;
    view->draw_count = view->triangle_count = 0;
    return TERRIMP_E_CAPACITY;
}

TERRIMP_API terrimp_result terrimp_geomip_select(const terrimp_quadtree *tree,
                                                 terrimp_geomip_view *view,
                                                 const terrimp_camera *camera)
{
    terrimp_geomip_view v;
    terrimp_camera c;
    terrimp_result result;
    TERRIMPI_REFUSE(!tree || !view, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(tree->pages, TERRIMP_E_PAGE);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    v = *view;
    TERRIMPI_TRY(terrimpi_mip_view_resolve(tree, &v));
    result = terrimpi_mip_select(tree, &v, &c);
    v.rule = view->rule;
    v.tolerance_px = view->tolerance_px;
    v.morph_ratio = view->morph_ratio;
    *view = v;
    return result;
}

/* ---- vertices and morphing ---- */

/* How far a vertex of a level's lattice moves between the levels `from` and `from` + 1 above. */
static float terrimpi_mip_move(const terrimpi_mip_ground *g, uint32_t level, uint32_t i, uint32_t j,
                               uint32_t from)
{
    uint32_t x = terrimpi_tree_col(g->tree, level, i), z = terrimpi_tree_row(g->tree, level, j);
    return terrimpi_mip_height(g, level + from + 1u, x, z) -
           terrimpi_mip_height(g, level + from, x, z);
}

/* The moves of a node's vertex (i, j); (i0, j0) is the node's first one on the lattice. */
static void terrimpi_mip_vertex(const terrimpi_mip_ground *g, uint32_t level, uint32_t i0,
                                uint32_t j0, uint32_t i, uint32_t j, terrimp_geomip_vertex *vertex)
{
    uint32_t last = g->tree->chunk_quads - 1u, both = i & j & 1u; /* odd and odd: on a diagonal */
    int odd = (i | j) & 1u, along_x = j == 0 || j == last + 1u, along_z = i == 0 || i == last + 1u;
    vertex->height = terrimpi_mip_sample(g, terrimpi_tree_col(g->tree, level, i0 + i),
                                         terrimpi_tree_row(g->tree, level, j0 + j));
    vertex->move = vertex->beside[0] = vertex->beside[1] = 0.0f;
    if ((along_x && along_z) || (!odd && (along_x || along_z)))
        vertex->move = terrimpi_mip_move(g, level, i0 + i, j0 + j, 1);
    else if (odd)
        vertex->move = terrimpi_mip_move(g, level, i0 + i, j0 + j, 0);
    if (!odd)
        return;
    if (j == 1u)
        vertex->beside[0] = 0.5f * terrimpi_mip_move(g, level, i0 + i - both, j0, 1);
    if (j == last)
        vertex->beside[0] = 0.5f * terrimpi_mip_move(g, level, i0 + i + both, j0 + last + 1u, 1);
    if (i == 1u)
        vertex->beside[1] = 0.5f * terrimpi_mip_move(g, level, i0, j0 + j - both, 1);
    if (i == last)
        vertex->beside[1] = 0.5f * terrimpi_mip_move(g, level, i0 + last + 1u, j0 + j + both, 1);
    if (along_x) /* between two border vertices: one of them moves */
        vertex->beside[0] = 0.5f * (terrimpi_mip_move(g, level, i0 + i - 1u, j0 + j, 1) +
                                    terrimpi_mip_move(g, level, i0 + i + 1u, j0 + j, 1));
    if (along_z)
        vertex->beside[1] = 0.5f * (terrimpi_mip_move(g, level, i0 + i, j0 + j - 1u, 1) +
                                    terrimpi_mip_move(g, level, i0 + i, j0 + j + 1u, 1));
}

/* The vertices of a node, and how they morph: what is not NULL. */
static void terrimpi_mip_fill(const terrimpi_mip_ground *g, const terrimp_node *n, float *xyz,
                              terrimp_geomip_vertex *vertices)
{
    const terrimp_quadtree *t = g->tree;
    uint32_t i, j, i0 = n->x * t->chunk_quads, j0 = n->z * t->chunk_quads;
    for (j = 0; j <= t->chunk_quads; j++)
        for (i = 0; i <= t->chunk_quads; i++) {
            if (xyz) {
                *xyz++ = terrimpi_tree_x(t, n->level, i0 + i);
                *xyz++ = terrimpi_mip_sample(g, terrimpi_tree_col(t, n->level, i0 + i),
                                             terrimpi_tree_row(t, n->level, j0 + j));
                *xyz++ = terrimpi_tree_z(t, n->level, j0 + j);
            }
            if (vertices)
                terrimpi_mip_vertex(g, n->level, i0, j0, i, j, vertices++);
        }
}

TERRIMP_API terrimp_result terrimp_geomip_fill_vertices(const terrimp_quadtree *tree, uint32_t node,
                                                        float *xyz,
                                                        terrimp_geomip_vertex *vertices)
{
    terrimpi_mip_ground ground;
    terrimp_node n;
    TERRIMPI_REFUSE(!tree || (!xyz && !vertices), TERRIMP_E_NULL);
    TERRIMPI_REFUSE(node >= tree->node_count, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!terrimpi_tree_opens(tree, node), TERRIMP_E_PAGE);
    n = terrimpi_tree_node(tree, node);
    ground = tree->pages ? tree->pages->calls->ground(tree, &n) : terrimpi_mip_ground_of(tree);
    terrimpi_mip_fill(&ground, &n, xyz, vertices);
    return TERRIMP_OK;
}

/* The weights of vertex k: odd vertices move to the parent's shape. */
static void terrimpi_mip_weights(uint32_t quads, uint32_t k, terrimp_geomip_weights *w)
{
    uint32_t row = quads + 1u, i = k % row, j = k / row, from[TERRIMP_SIDE_COUNT], side;
    uint8_t odd = (i | j) & 1u;
    memset(w, 0, sizeof *w);
    from[TERRIMP_SIDE_Z0] = j;
    from[TERRIMP_SIDE_Z1] = quads - j;
    from[TERRIMP_SIDE_X0] = i;
    from[TERRIMP_SIDE_X1] = quads - i;
    w->self = odd;
    for (side = 0; side < TERRIMP_SIDE_COUNT; side++) {
        w->beside[side] = from[side] == 1u || (from[side] == 0 && odd);
        if (from[side] > 0)
            continue;
        (odd ? w->odd : w->even)[side] = 1;
        w->self = 0;
    }
}

TERRIMP_API terrimp_result terrimp_geomip_fill_weights(uint32_t chunk_quads,
                                                       terrimp_geomip_weights *weights)
{
    uint32_t k;
    TERRIMPI_REFUSE(!weights, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_tree_quads_fit(chunk_quads), TERRIMP_E_RANGE);
    for (k = 0; k < (chunk_quads + 1u) * (chunk_quads + 1u); k++)
        terrimpi_mip_weights(chunk_quads, k, &weights[k]);
    return TERRIMP_OK;
}

static float terrimpi_mip_dot4(const uint8_t weight[4], const float factor[4])
{
    return (float)weight[0] * factor[0] + (float)weight[1] * factor[1] +
           (float)weight[2] * factor[2] + (float)weight[3] * factor[3];
}

TERRIMP_API terrimp_result terrimp_geomip_morph(uint32_t chunk_quads,
                                                const terrimp_geomip_draw *draw,
                                                const terrimp_geomip_vertex *vertices,
                                                float *heights, size_t stride)
{
    uint32_t k;
    TERRIMPI_REFUSE(!draw || !vertices || !heights, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_tree_quads_fit(chunk_quads) || stride == 0, TERRIMP_E_RANGE);
    for (k = 0; k < (chunk_quads + 1u) * (chunk_quads + 1u); k++, vertices++, heights += stride) {
        const float *coarse = draw->side_coarse;
        terrimp_geomip_weights w;
        float factor, along_z, along_x;
        terrimpi_mip_weights(chunk_quads, k, &w);
        factor = (float)w.self * draw->morph + terrimpi_mip_dot4(w.odd, draw->side) +
                 terrimpi_mip_dot4(w.even, coarse);
        along_z = (float)w.beside[TERRIMP_SIDE_Z0] * coarse[TERRIMP_SIDE_Z0] +
                  (float)w.beside[TERRIMP_SIDE_Z1] * coarse[TERRIMP_SIDE_Z1];
        along_x = (float)w.beside[TERRIMP_SIDE_X0] * coarse[TERRIMP_SIDE_X0] +
                  (float)w.beside[TERRIMP_SIDE_X1] * coarse[TERRIMP_SIDE_X1];
        *heights = vertices->height + factor * (vertices->move + vertices->beside[0] * along_z +
                                                vertices->beside[1] * along_x);
    }
    return TERRIMP_OK;
}

/* ==== Impostor =========================================================== >>impl-impostor */
/* Based on: Hess 2010, sections 3.3 to 3.5 and 6.2. */

#define TERRIMPI_SPLIT_COUNT 24u /* places of a split that are tried */
#define TERRIMPI_SPLIT_CELLS 16 /* along a side, of the map in which hidden triangles are found */
#define TERRIMPI_IMPOSTOR_IN_SIGHT 0.98f /* of the way to a point: beyond, its neighbour hides it */

/* The size of a picture of width x height texels within limits; returns the scale. */
static float terrimpi_picture_size(float width, float height, uint32_t smallest, uint32_t largest,
                                   uint32_t size[2])
{
    float longest = terrimpi_max(width, height), reduce = 1.0f;
    if (longest > (float)largest)
        reduce = (float)largest / longest;
    size[0] = terrimpi_clamp_u32(terrimpi_ceil_u32(width * reduce), smallest, largest);
    size[1] = terrimpi_clamp_u32(terrimpi_ceil_u32(height * reduce), smallest, largest);
    return reduce;
}

TERRIMP_API terrimp_result terrimp_impostor_size(const terrimp_capture *capture, float pixel_factor,
                                                 float texels_per_px, uint32_t smallest,
                                                 uint32_t largest, uint32_t size[2], float *scale)
{
    float density, width, height, reduce;
    TERRIMPI_REFUSE(!capture || !size, TERRIMP_E_NULL);
    density = pixel_factor * texels_per_px;
    width = (capture->tan_right - capture->tan_left) * density;
    height = (capture->tan_up - capture->tan_down) * density;
    TERRIMPI_REFUSE(!terrimpi_finite2(width, height), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(pixel_factor > 0.0f) || !(texels_per_px > 0.0f) || !(width > 0.0f) ||
                    !(height > 0.0f) || largest < 1u || largest > 65536u ||
                    smallest > largest, TERRIMP_E_RANGE);
    reduce = terrimpi_picture_size(width, height, smallest, largest, size);
    if (scale)
        *scale = reduce;
    return TERRIMP_OK;
}

/* Widens [low, high], which `inner` texels show, by `margin` texels on both sides. */
static void terrimpi_impostor_pad(float *low, float *high, uint32_t inner, uint32_t margin)
{
    float by = (*high - *low) * (float)margin / (float)inner;
    *low -= by;
    *high += by;
}

TERRIMP_API terrimp_result terrimp_capture_pad(terrimp_capture *capture, const uint32_t slot[2],
                                               uint32_t margin)
{
    TERRIMPI_REFUSE(!capture || !slot, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(margin > 65536u || slot[0] <= 2u * margin ||
                    slot[1] <= 2u * margin, TERRIMP_E_RANGE);
    terrimpi_impostor_pad(&capture->tan_left, &capture->tan_right, slot[0] - 2u * margin, margin);
    terrimpi_impostor_pad(&capture->tan_down, &capture->tan_up, slot[1] - 2u * margin, margin);
    return TERRIMP_OK;
}

static void terrimpi_impostor_texture_matrix(const terrimp_capture *capture,
                                             const terrimp_rect *slot,
                                             uint32_t atlas_width, uint32_t atlas_height,
                                             float matrix[16])
{
    float view[16], projection[16];
    float scale[3], offset[3]; /* clip space to atlas */
    int row, column;
    terrimp_capture_matrices(capture, 0, view, projection);
    view[12] = view[13] = view[14] = 0.0f; /* relative to the eye */
    scale[0] = 0.5f * (float)slot->width / (float)atlas_width;
    scale[1] = 0.5f * (float)slot->height / (float)atlas_height;
    scale[2] = 0.5f;
    offset[0] = (float)slot->x / (float)atlas_width + scale[0];
    offset[1] = (float)slot->y / (float)atlas_height + scale[1];
    offset[2] = 0.5f;
    /* Row i of the result: scale[i] * row i of P V + offset[i] * row 3 of P V, where row 3 is the
       distance along forward, or 1: the q that s and t are divided by. */
    for (column = 0; column < 4; column++) {
        const float *v = view + column * 4;
        float q = capture->orthographic ? v[3] : -v[2];
        for (row = 0; row < 3; row++) {
            float clip = projection[row] * v[0] + projection[4 + row] * v[1] +
                         projection[8 + row] * v[2] + projection[12 + row] * v[3];
            matrix[column * 4 + row] = scale[row] * clip + offset[row] * q;
        }
        matrix[column * 4 + 3] = q;
    }
}

static int terrimpi_impostor_slot_in_atlas(const terrimp_rect *slot, uint32_t width,
                                           uint32_t height)
{
    return slot->width >= 1u && slot->height >= 1u && slot->x <= width &&
           slot->width <= width - slot->x && slot->y <= height && slot->height <= height - slot->y;
}

TERRIMP_API terrimp_result terrimp_texture_matrix(const terrimp_capture *capture,
                                                  const terrimp_rect *slot, uint32_t atlas_width,
                                                  uint32_t atlas_height, float matrix[16])
{
    TERRIMPI_REFUSE(!capture || !slot || !matrix, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_impostor_slot_in_atlas(slot, atlas_width, atlas_height),
                    TERRIMP_E_RANGE);
    terrimpi_impostor_texture_matrix(capture, slot, atlas_width, atlas_height, matrix);
    return TERRIMP_OK;
}

/* A place at the distance z along forward is z (forward + x right + y up) from the capture's eye,
   with tangents x and y that grow with s and t; and 1 / z grows with the depth, from 1 / z_near to
   1 / z_far. So (place, 1) / z is linear in all three. Of an orthographic capture the place is. */
static void terrimpi_impostor_place_matrix(const terrimp_capture *c, const terrimp_rect *slot,
                                           uint32_t atlas_width, uint32_t atlas_height,
                                           float matrix[16])
{
    float across = (c->tan_right - c->tan_left) / (float)slot->width;
    float upward = (c->tan_up - c->tan_down) / (float)slot->height;
    float x = c->tan_left - across * (float)slot->x, y = c->tan_down - upward * (float)slot->y;
    float depth = c->orthographic ? c->z_far - c->z_near : 0.0f;
    float ahead = c->orthographic ? c->z_near : 1.0f;
    int i;
    for (i = 0; i < 3; i++) {
        matrix[i] = c->right[i] * across * (float)atlas_width;
        matrix[4 + i] = c->up[i] * upward * (float)atlas_height;
        matrix[8 + i] = c->forward[i] * depth;
        matrix[12 + i] = c->forward[i] * ahead + c->right[i] * x + c->up[i] * y;
    }
    matrix[3] = matrix[7] = 0.0f;
    matrix[11] = c->orthographic ? 0.0f : 1.0f / c->z_far - 1.0f / c->z_near;
    matrix[15] = c->orthographic ? 1.0f : 1.0f / c->z_near;
}

/* From places relative to one eye to those relative to another. */
static void terrimpi_impostor_place_from(float matrix[16], const float from[3], const float eye[3])
{
    int i, column;
    for (column = 0; column < 16; column += 4)
        for (i = 0; i < 3; i++)
            matrix[column + i] += matrix[column + 3] * (from[i] - eye[i]);
}

TERRIMP_API terrimp_result terrimp_place_matrix(const terrimp_capture *capture,
                                                const terrimp_rect *slot, uint32_t atlas_width,
                                                uint32_t atlas_height, const float eye[3],
                                                float matrix[16])
{
    TERRIMPI_REFUSE(!capture || !slot || !eye || !matrix, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_impostor_slot_in_atlas(slot, atlas_width, atlas_height),
                    TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!terrimpi_finite3(eye), TERRIMP_E_NOT_FINITE);
    terrimpi_impostor_place_matrix(capture, slot, atlas_width, atlas_height, matrix);
    terrimpi_impostor_place_from(matrix, capture->eye, eye);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_normal_encode(const float normal[3], uint8_t code[2])
{
    float x, z, sum;
    TERRIMPI_REFUSE(!normal || !code, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(normal), TERRIMP_E_NOT_FINITE);
    sum = terrimpi_largest(normal); /* first, so that nothing overflows */
    TERRIMPI_REFUSE(!(sum > 0.0f) || normal[1] < 0.0f, TERRIMP_E_RANGE);
    x = normal[0] / sum;
    z = normal[2] / sum;
    sum = terrimpi_abs(x) + normal[1] / sum + terrimpi_abs(z);
    code[0] = (uint8_t)(((x + z) / sum + 1.0f) * 127.5f + 0.5f);
    code[1] = (uint8_t)(((x - z) / sum + 1.0f) * 127.5f + 0.5f);
    return TERRIMP_OK;
}

TERRIMP_API void terrimp_normal_decode(const uint8_t code[2], float normal[3])
{
    float a = (float)code[0] / 127.5f - 1.0f, b = (float)code[1] / 127.5f - 1.0f;
    normal[0] = 0.5f * (a + b);
    normal[2] = 0.5f * (a - b);
    normal[1] = terrimpi_max(1.0f - terrimpi_abs(normal[0]) - terrimpi_abs(normal[2]), 0.0f);
    terrimpi_normalize(normal);
}

TERRIMP_API terrimp_result terrimp_texture_coordinates(const float matrix[16], const float eye[3],
                                                       const float *xyz, size_t count, float *stq)
{
    static const int rows[3] = {0, 1, 3};
    size_t i;
    int k;
    TERRIMPI_REFUSE(!matrix || !eye || (count && (!xyz || !stq)), TERRIMP_E_NULL);
    for (i = 0; i < count; i++, xyz += 3, stq += 3) {
        float to[3];
        terrimpi_sub(xyz, eye, to);
        for (k = 0; k < 3; k++) {
            const float *m = matrix + rows[k];
            stq[k] = m[0] * to[0] + m[4] * to[1] + m[8] * to[2] + m[12];
        }
    }
    return TERRIMP_OK;
}

static terrimp_result terrimpi_impostor_check_eyes(const terrimp_box *box,
                                                   const float captured_eye[3],
                                                   const float eye[3], const float *out)
{
    TERRIMPI_REFUSE(!box || !captured_eye || !eye || !out, TERRIMP_E_NULL);
    return terrimpi_finite3(box->min) && terrimpi_finite3(box->max) &&
                   terrimpi_finite3(captured_eye) && terrimpi_finite3(eye)
               ? TERRIMP_OK : TERRIMP_E_NOT_FINITE;
}

/* The functions of this room that a view calls check nothing; those of the API do. */
static float terrimpi_impostor_view_angle(const terrimp_box *box, const float captured_eye[3],
                                          const float eye[3])
{
    float worst = 0.0f; /* grows with the angle: its sine up to 60 degrees, then 2 - its cosine */
    int i;
    for (i = 0; i < 8; i++) {
        float a[3], b[3], across[3], cosine;
        terrimpi_camera_box_corner(box, i, captured_eye, a);
        terrimpi_camera_box_corner(box, i, eye, b);
        if (!terrimpi_normalize(a) || !terrimpi_normalize(b))
            continue; /* an eye on the corner has no direction to it */
        cosine = terrimpi_dot(a, b);
        terrimpi_cross(a, b, across);
        /* The cosine is blind to small angles, the sine to those around 90 degrees. */
        worst = terrimpi_max(worst, cosine > 0.5f ? terrimpi_length(across) : 2.0f - cosine);
    }
    return worst <= 1.0f ? TERRIMP_ASINF(worst) : TERRIMP_ACOSF(terrimpi_max(2.0f - worst, -1.0f));
}

TERRIMP_API terrimp_result terrimp_view_angle(const terrimp_box *box, const float captured_eye[3],
                                              const float eye[3], float *angle_rad)
{
    TERRIMPI_TRY(terrimpi_impostor_check_eyes(box, captured_eye, eye, angle_rad));
    *angle_rad = terrimpi_impostor_view_angle(box, captured_eye, eye);
    return TERRIMP_OK;
}

/* The largest sine of the angle between `move` and the directions from `eye` to the points of a
   box: those directions lie in a cone around the one to the box's centre. */
static float terrimpi_impostor_largest_sine(const terrimp_box *box, const float eye[3],
                                            const float move[3], float move_length)
{
    float centre[3], half[3], across[3], distance, radius, sine, cosine, cone_sine, cone_cosine;
    int i;
    for (i = 0; i < 3; i++) {
        half[i] = (box->max[i] - box->min[i]) * 0.5f;
        centre[i] = box->min[i] + half[i] - eye[i];
    }
    distance = terrimpi_length(centre);
    radius = terrimpi_length(half);
    if (!(distance > radius))
        return 1.0f;
    terrimpi_cross(move, centre, across);
    sine = terrimpi_min(1.0f, terrimpi_length(across) / (move_length * distance));
    cosine = TERRIMP_SQRTF(1.0f - sine * sine);
    cone_sine = radius / distance;
    cone_cosine = TERRIMP_SQRTF(1.0f - cone_sine * cone_sine);
    /* The right angle lies within the cone when sine >= cos of the cone's half angle. */
    if (sine >= cone_cosine)
        return 1.0f;
    return terrimpi_min(1.0f, sine * cone_cosine + cosine * cone_sine + 1e-5f);
}

/* A terrain point P lies at most `error` from the mesh along its ray of the capture from A, so its
   texel is shown at a point Q of that ray, |PQ| <= error. Seen from B the two are apart by an angle
   whose sine is |PQ| sin(APB) / |QB|, and in the triangle ABP the law of sines gives
   sin(APB) = |AB| sin(BAP) / |BP|. With d the distance from B to the box, which holds P:
   |BP| >= d, |QB| >= d - error. The tangent of that angle times K is the distance in pixels at the
   middle of the screen. For all eyes within `reach` of B: d shrinks by that, and the angle APB
   grows by one whose sine is at most reach / d. */
static float terrimpi_impostor_parallax_error(const terrimp_box *box, float error,
                                              const float captured_eye[3], const float eye[3],
                                              float reach, float pixel_factor)
{
    float move[3], move_length, distance, sine;
    terrimpi_sub(eye, captured_eye, move);
    move_length = terrimpi_length(move);
    if (!(move_length + reach > 0.0f) || !(error > 0.0f))
        return 0.0f;
    distance = terrimp_box_distance(box, eye) - reach;
    sine = 1.0f;
    if (distance > error) {
        float turn = reach / distance;
        if (move_length > 0.0f)
            turn += move_length / distance *
                    terrimpi_impostor_largest_sine(box, captured_eye, move, move_length);
        sine = error / (distance - error) * terrimpi_min(1.0f, turn);
    }
    return sine < 0.999f ? pixel_factor * sine / TERRIMP_SQRTF(1.0f - sine * sine)
                         : TERRIMPI_INFINITY;
}

TERRIMP_API terrimp_result terrimp_parallax_error(const terrimp_box *box, float error,
                                                  const float captured_eye[3], const float eye[3],
                                                  float pixel_factor, float *error_px)
{
    TERRIMPI_TRY(terrimpi_impostor_check_eyes(box, captured_eye, eye, error_px));
    TERRIMPI_REFUSE(!terrimpi_finite2(error, pixel_factor), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(error < 0.0f || !(pixel_factor > 0.0f), TERRIMP_E_RANGE);
    *error_px = terrimpi_impostor_parallax_error(box, error, captured_eye, eye, 0.0f, pixel_factor);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_impostor_lifetime(float distance, float max_angle_rad,
                                                     float speed, float *seconds)
{
    float sine;
    TERRIMPI_REFUSE(!seconds, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite2(distance, max_angle_rad) || !terrimpi_finite(speed),
                    TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(distance < 0.0f || !terrimpi_within(max_angle_rad, 0.0f, 3.1415928f) ||
                    !(speed > 0.0f), TERRIMP_E_RANGE);
    sine = max_angle_rad < 1.5707963f ? TERRIMP_SINF(max_angle_rad) : 1.0f;
    *seconds = distance * sine / speed;
    return TERRIMP_OK;
}

/* A mesh as the eye of a capture sees it: for each of a few cells of the picture the closest
   triangle that faces the eye, and 1 / depth there. A point is (across, up, 1 / depth), the first
   two in cells: planes stay planes, and an eye that moves by r moves a point by r / depth. */
typedef struct terrimpi_split_map {
    const terrimp_capture *capture;
    const float *xyz;
    const uint16_t *indices;
    float low[2], cells[2]; /* first edge of the cells; cells for one unit at depth 1 */
    float closest[TERRIMPI_SPLIT_CELLS][TERRIMPI_SPLIT_CELLS]; /* 0: there is none */
    uint16_t own[TERRIMPI_SPLIT_CELLS][TERRIMPI_SPLIT_CELLS];  /* first index of its triangle */
} terrimpi_split_map;

static void terrimpi_split_point(const terrimpi_split_map *m, const float xyz[3], float p[3])
{
    float to[3];
    terrimpi_sub(xyz, m->capture->eye, to);
    p[2] = 1.0f / terrimpi_max(terrimpi_dot(to, m->capture->forward), 1e-20f);
    p[0] = (terrimpi_dot(to, m->capture->right) * p[2] - m->low[0]) * m->cells[0];
    p[1] = (terrimpi_dot(to, m->capture->up) * p[2] - m->low[1]) * m->cells[1];
}

static void terrimpi_split_corners(const terrimpi_split_map *m, uint32_t first, float p[3][3])
{
    uint32_t i;
    for (i = 0; i < 3u; i++)
        terrimpi_split_point(m, m->xyz + m->indices[first + i] * 3u, p[i]);
}

/* Twice the area of a triangle of the picture, less than 0 when it is seen from behind, for an eye
   that has moved by so many cells at depth 1. */
static float terrimpi_split_area(float p[3][3], float move_x, float move_y)
{
    float w1 = p[1][2] - p[0][2], w2 = p[2][2] - p[0][2];
    return (p[1][0] - p[0][0] - move_x * w1) * (p[2][1] - p[0][1] - move_y * w2) -
           (p[2][0] - p[0][0] - move_x * w2) * (p[1][1] - p[0][1] - move_y * w1);
}

/* 1 / depth of a triangle's plane at a place of the picture; sets *inside to less than 0 where that
   is not in the triangle. `area` is that of the triangle. */
static float terrimpi_split_plane(float p[3][3], float area, float x, float y, float *inside)
{
    float a = (p[1][0] - x) * (p[2][1] - y) - (p[2][0] - x) * (p[1][1] - y);
    float b = (p[2][0] - x) * (p[0][1] - y) - (p[0][0] - x) * (p[2][1] - y);
    *inside = terrimpi_min(terrimpi_min(a, b), area - a - b);
    return p[2][2] + (a * (p[0][2] - p[2][2]) + b * (p[1][2] - p[2][2])) / area;
}

/* The cells whose middles lie within low..high. */
static void terrimpi_split_range(float a, float b, float c, int *low, int *high)
{
    const float last = (float)TERRIMPI_SPLIT_CELLS;
    *low = (int)terrimpi_clamp(terrimpi_min(a, terrimpi_min(b, c)) + 0.5f, 0.0f, last);
    *high = (int)terrimpi_clamp(terrimpi_max(a, terrimpi_max(b, c)) + 0.5f, 0.0f, last);
}

/* Enters a triangle into the cells that it is the closest in. */
static void terrimpi_split_draw(terrimpi_split_map *m, uint32_t first, float p[3][3])
{
    float area = terrimpi_split_area(p, 0.0f, 0.0f);
    int x, y, x0, x1, y0, y1;
    if (!(area > 0.0f))
        return;
    terrimpi_split_range(p[0][0], p[1][0], p[2][0], &x0, &x1);
    terrimpi_split_range(p[0][1], p[1][1], p[2][1], &y0, &y1);
    for (y = y0; y < y1; y++)
        for (x = x0; x < x1; x++) {
            float inside, w;
            w = terrimpi_split_plane(p, area, (float)x + 0.5f, (float)y + 0.5f, &inside);
            if (inside >= 0.0f && w > m->closest[y][x]) {
                m->closest[y][x] = w;
                m->own[y][x] = (uint16_t)first;
            }
        }
}

/* Sums over a mesh as the moved eyes see it. */
typedef struct terrimpi_split_gap {
    float seen;                   /* size of all triangles */
    float all;                    /* sizes times squared gaps, of those that were hidden */
    float saved[TERRIMPI_SPLIT_COUNT]; /* ... and that a split would spare */
} terrimpi_split_gap;

/* Whether a point that is hidden at cell (x, y) still is after the eye has moved towards larger x
   (or y, or smaller x), by `move` cells at depth 1. What hides it stretches up to a crest, some
   cells in that direction, and moves by more than the point does. */
static int terrimpi_split_still(const terrimpi_split_map *m, int x, int y, int step_x, int step_y,
                                float move, float w)
{
    float away = 0.5f;
    while (x >= 0 && x < TERRIMPI_SPLIT_CELLS && y < TERRIMPI_SPLIT_CELLS &&
           m->closest[y][x] * TERRIMPI_IMPOSTOR_IN_SIGHT > w) {
        if (away >= move * (m->closest[y][x] - w))
            return 1;
        away += 1.0f;
        x += step_x;
        y += step_y;
    }
    return 0;
}

/* The part of the way to a point of cell (x, y) after which something hides it, or 1. */
static float terrimpi_split_hit(const terrimpi_split_map *m, int x, int y, const float point[3])
{
    float p[3][3], inside, w;
    if (!(m->closest[y][x] * TERRIMPI_IMPOSTOR_IN_SIGHT > point[2]))
        return 1.0f;
    terrimpi_split_corners(m, m->own[y][x], p);
    w = terrimpi_split_plane(p, terrimpi_split_area(p, 0.0f, 0.0f), point[0], point[1], &inside);
    return w > point[2] ? point[2] / w : 1.0f;
}

/* Adds a triangle, for eyes that have moved up, right and left. Places of a split: first + (k + 1)
   * step. */
static void terrimpi_split_add(const terrimpi_split_map *m, float p[3][3], float reach,
                               float overlap, float first, float step, terrimpi_split_gap *smear)
{
    static const int ways[3][2] = { { 0, 1 }, { 1, 0 }, { -1, 0 } };
    const float last = (float)(TERRIMPI_SPLIT_CELLS - 1);
    float middle[3], hit, depth;
    int x, y, way;
    uint32_t k;
    for (k = 0; k < 3u; k++)
        middle[k] = (p[0][k] + p[1][k] + p[2][k]) * (1.0f / 3.0f);
    x = (int)terrimpi_clamp(middle[0], 0.0f, last);
    y = (int)terrimpi_clamp(middle[1], 0.0f, last);
    hit = terrimpi_split_hit(m, x, y, middle);
    depth = 1.0f / middle[2];
    for (way = 0; way < 3; way++) {
        int up = ways[way][1];
        float size = terrimpi_split_area(p, (float)ways[way][0] * reach * m->cells[0],
                                         (float)up * reach * m->cells[1]), weight;
        if (!(size > 0.0f))
            continue;
        smear->seen += size;
        if (hit > TERRIMPI_IMPOSTOR_IN_SIGHT ||
            terrimpi_split_still(m, x, y, ways[way][0], up, reach * m->cells[up], middle[2]))
            continue;
        weight = size * (1.0f - hit) * (1.0f - hit);
        smear->all += weight;
        for (k = 0; k < TERRIMPI_SPLIT_COUNT; k++) {
            float at = first + (float)(k + 1u) * step;
            if (depth * hit < at - overlap && depth > at + overlap)
                smear->saved[k] += weight;
        }
    }
}

/* Sets the cells over all vertices; they lie between the depths 1 / *w_most and 1 / *w_least. */
static void terrimpi_split_set_cells(terrimpi_split_map *m, uint32_t vertex_count, float *w_least,
                                     float *w_most)
{
    float low[3], high[3], p[3];
    uint32_t i, k;
    memset(m->closest, 0, sizeof m->closest);
    m->low[0] = m->low[1] = 0.0f;
    m->cells[0] = m->cells[1] = 1.0f;
    terrimpi_split_point(m, m->xyz, low);
    memcpy(high, low, sizeof high);
    for (i = 1; i < vertex_count; i++) {
        terrimpi_split_point(m, m->xyz + i * 3u, p);
        for (k = 0; k < 3u; k++) {
            low[k] = terrimpi_min(low[k], p[k]);
            high[k] = terrimpi_max(high[k], p[k]);
        }
    }
    for (k = 0; k < 2u; k++) {
        m->low[k] = low[k];
        m->cells[k] = (float)TERRIMPI_SPLIT_CELLS / terrimpi_max(high[k] - low[k], 1e-20f);
    }
    *w_least = low[2];
    *w_most = high[2];
}

/* terrimp_capture_split of checked arguments. */
static void terrimpi_impostor_split(const terrimp_capture *capture, const float *xyz,
                                    uint32_t vertex_count, const uint16_t *indices,
                                    uint32_t index_count, float reach, float overlap,
                                    terrimp_split *split)
{
    float first, step, w_least, w_most, p[3][3];
    uint32_t i, k, best = 0;
    terrimpi_split_map map;
    terrimpi_split_gap smear;
    map.capture = capture;
    map.xyz = xyz;
    map.indices = indices;
    terrimpi_split_set_cells(&map, vertex_count, &w_least, &w_most);
    first = 1.0f / w_most;
    step = (1.0f / w_least - first) / (float)(TERRIMPI_SPLIT_COUNT + 1u);
    for (i = 0; i < index_count; i += 3u) {
        terrimpi_split_corners(&map, i, p);
        terrimpi_split_draw(&map, i, p);
    }
    memset(&smear, 0, sizeof smear);
    for (i = 0; i < index_count; i += 3u) {
        terrimpi_split_corners(&map, i, p);
        terrimpi_split_add(&map, p, reach, overlap, first, step, &smear);
    }
    for (k = 1; k < TERRIMPI_SPLIT_COUNT; k++)
        if (smear.saved[k] > smear.saved[best])
            best = k;
    memset(split, 0, sizeof *split);
    if (!(smear.all > 0.0f))
        return;
    split->distance = first + (float)(best + 1u) * step;
    split->gap = TERRIMP_SQRTF(smear.all / smear.seen);
    split->gap_left = TERRIMP_SQRTF(terrimpi_max(0.0f, smear.all - smear.saved[best]) / smear.seen);
}

TERRIMP_API terrimp_result terrimp_capture_split(const terrimp_capture *capture, const float *xyz,
                                                 uint32_t vertex_count, const uint16_t *indices,
                                                 uint32_t index_count, float reach, float overlap,
                                                 terrimp_split *split)
{
    uint32_t i;
    TERRIMPI_REFUSE(!capture || !xyz || !indices || !split, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite(reach) || !terrimpi_finite(overlap), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(vertex_count == 0 || index_count % 3u != 0, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(!(reach > 0.0f) || overlap < 0.0f || capture->orthographic, TERRIMP_E_RANGE);
    for (i = 0; i < index_count; i++)
        TERRIMPI_REFUSE(indices[i] >= vertex_count, TERRIMP_E_RANGE);
    terrimpi_impostor_split(capture, xyz, vertex_count, indices, index_count, reach, overlap,
                            split);
    return TERRIMP_OK;
}

/* ==== Atlas ============================================================== >>impl-atlas */
/* Based on: Hess 2010, section 4.3. */

/* Whether rectangle a comes after b: lower, or as high and narrower, or later. */
static int terrimpi_pack_after(const void *rects, uint32_t a, uint32_t b)
{
    const terrimp_rect *p = (const terrimp_rect *)rects + a;
    const terrimp_rect *q = (const terrimp_rect *)rects + b;
    if (p->height != q->height)
        return p->height < q->height;
    if (p->width != q->width)
        return p->width < q->width;
    return a > b;
}

/* A side at a scale <= 1; whole at 1, since a float could round a huge one out of its type. */
static uint32_t terrimpi_pack_side(uint32_t side, float scale)
{
    return scale < 1.0f && side ? terrimpi_max_u32(1u, (uint32_t)((float)side * scale)) : side;
}

/* Finds places for all at a scale; returns whether there are. `shelves` lists the first rectangle
   of each shelf, whose x meanwhile says how far the shelf is taken. */
static int terrimpi_pack_try(uint32_t width, uint32_t height, terrimp_rect *rects, uint32_t count,
                             const uint32_t *order, uint32_t *shelves, float scale)
{
    uint32_t i, k, shelf_count = 0, top = 0;
    for (i = 0; i < count; i++) {
        terrimp_rect *rect = &rects[order[i]], *first;
        uint32_t wide = terrimpi_pack_side(rect->width, scale);
        uint32_t high = terrimpi_pack_side(rect->height, scale);
        if (wide == 0 || high == 0)
            continue;
        if (wide > width || high > height)
            return 0;
        for (k = 0; k < shelf_count && rects[shelves[k]].x > width - wide;)
            k++;
        if (k == shelf_count) {
            if (top > height - high)
                return 0;
            shelves[shelf_count++] = order[i];
            rect->x = 0;
            rect->y = top;
            top += high;
        }
        first = &rects[shelves[k]];
        rect->y = first->y;
        rect->x = first->x;
        first->x += wide;
    }
    for (k = 0; k < shelf_count; k++)
        rects[shelves[k]].x = 0;
    return 1;
}

TERRIMP_API terrimp_result terrimp_pack_ffdh(uint32_t width, uint32_t height, terrimp_rect *rects,
                                             uint32_t count, uint32_t *order, float *scale)
{
    float by = 1.0f;
    uint32_t i;
    TERRIMPI_REFUSE(count && (!rects || !order), TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_within_u32(width, 1u, 65536u) ||
                    !terrimpi_within_u32(height, 1u, 65536u), TERRIMP_E_RANGE);
    for (i = 0; i < count; i++)
        order[i] = i;
    terrimpi_sort(order, count, rects, terrimpi_pack_after);
    /* at most 360 steps, from 2^32 texels down to one */
    while (count && !terrimpi_pack_try(width, height, rects, count, order, order + count, by)) {
        TERRIMPI_REFUSE(by < 2e-10f, TERRIMP_E_CAPACITY);
        by *= 0.94f;
    }
    for (i = 0; i < count; i++) {
        rects[i].width = terrimpi_pack_side(rects[i].width, by);
        rects[i].height = terrimpi_pack_side(rects[i].height, by);
    }
    if (scale)
        *scale = by;
    return TERRIMP_OK;
}

/* ---- the live atlas ----

   The free space is kept as all of its maximal free rectangles: those that no other one contains. A
   rectangle fits somewhere if and only if it fits into one of them, and neighbouring free areas
   need no merging. One operation makes them all: cutting a rectangle out of a list of them. An
   allocation cuts the new slot out of the list. When a slot is freed, those that overlap it are the
   whole atlas with every other slot cut out, as far as they overlap it.

   Padding lies to the right of and above each slot, and may leave the atlas there: slots and atlas
   count as larger by it, so that the rest of the code need not know of it. */

static int terrimpi_atlas_overlap(const terrimp_rect *a, const terrimp_rect *b)
{
    return a->x < b->x + b->width && b->x < a->x + a->width && a->y < b->y + b->height &&
           b->y < a->y + a->height;
}

static int terrimpi_atlas_contains(const terrimp_rect *outer, const terrimp_rect *inner)
{
    return outer->x <= inner->x && outer->y <= inner->y &&
           inner->x + inner->width <= outer->x + outer->width &&
           inner->y + inner->height <= outer->y + outer->height;
}

/* The part of a rectangle to the left of, to the right of, below or above what overlaps it; of
   width or height 0 when there is none. */
static terrimp_rect terrimpi_atlas_beside(const terrimp_rect *rect, const terrimp_rect *taken,
                                          int side)
{
    uint32_t right = rect->x + rect->width, top = rect->y + rect->height;
    uint32_t left_cut = terrimpi_max_u32(rect->x, taken->x);
    uint32_t right_cut = terrimpi_min_u32(right, taken->x + taken->width);
    uint32_t low_cut = terrimpi_max_u32(rect->y, taken->y);
    uint32_t top_cut = terrimpi_min_u32(top, taken->y + taken->height);
    switch (side) {
    case 0: return terrimpi_rect(rect->x, rect->y, left_cut - rect->x, rect->height);
    case 1: return terrimpi_rect(right_cut, rect->y, right - right_cut, rect->height);
    case 2: return terrimpi_rect(rect->x, rect->y, rect->width, low_cut - rect->y);
    default: return terrimpi_rect(rect->x, top_cut, rect->width, top - top_cut);
    }
}

/* Whether rectangles overlap or have a piece of an edge or a corner in common. */
static int terrimpi_atlas_touch(const terrimp_rect *a, const terrimp_rect *b)
{
    return a->x <= b->x + b->width && b->x <= a->x + a->width && a->y <= b->y + b->height &&
           b->y <= a->y + a->height;
}

/* Moves the free rectangles from `begin` on that touch a rectangle to the end; returns the first
   of them. */
static uint32_t terrimpi_atlas_free_part(terrimp_live_atlas *atlas, uint32_t begin,
                                         const terrimp_rect *rect)
{
    uint32_t i, first = begin;
    for (i = begin; i < atlas->free_count; i++)
        if (!terrimpi_atlas_touch(&atlas->free_rects[i], rect)) {
            terrimp_rect swap = atlas->free_rects[i];
            atlas->free_rects[i] = atlas->free_rects[first];
            atlas->free_rects[first++] = swap;
        }
    return first;
}

/* Marks the free rectangles from `first` to `last` that one from `by` on contains: their width
   becomes 0. */
static void terrimpi_atlas_free_mark(terrimp_live_atlas *atlas, uint32_t first, uint32_t last,
                                     uint32_t by)
{
    terrimp_rect *rects = atlas->free_rects;
    uint32_t i, k;
    for (i = first; i < last; i++)
        for (k = by; k < atlas->free_count; k++)
            if (k != i && rects[k].width > 0 && terrimpi_atlas_contains(&rects[k], &rects[i])) {
                rects[i].width = 0;
                break;
            }
}

/* Removes the marked free rectangles from `first` on. */
static void terrimpi_atlas_free_compact(terrimp_live_atlas *atlas, uint32_t first)
{
    uint32_t i, kept = first;
    for (i = first; i < atlas->free_count; i++)
        if (atlas->free_rects[i].width > 0)
            atlas->free_rects[kept++] = atlas->free_rects[i];
    atlas->free_count = kept;
}

/* Cuts a rectangle out of the free ones from `begin` on. Of the pieces, those that are maximal and
   overlap `window` are kept; what contains one of them touches the rectangle as they do. A piece
   for which there is no memory is lost until a slot beside it is freed. */
static void terrimpi_atlas_free_cut(terrimp_live_atlas *atlas, uint32_t begin,
                                    const terrimp_rect *taken, const terrimp_rect *window)
{
    terrimp_rect *rects = atlas->free_rects;
    uint32_t i, first = terrimpi_atlas_free_part(atlas, begin, taken), old = atlas->free_count;
    int side, cut = 0;
    for (i = first; i < old; i++) {
        if (!terrimpi_atlas_overlap(&rects[i], taken))
            continue;
        for (side = 0; side < 4; side++) {
            terrimp_rect piece = terrimpi_atlas_beside(&rects[i], taken, side);
            if (piece.width > 0 && piece.height > 0 && terrimpi_atlas_overlap(&piece, window) &&
                atlas->free_count < atlas->max_free)
                rects[atlas->free_count++] = piece;
        }
        rects[i].width = 0;
        cut = 1;
    }
    if (cut) {
        terrimpi_atlas_free_mark(atlas, old, atlas->free_count, first);
        terrimpi_atlas_free_compact(atlas, first);
    }
}

/* The largest number of free rectangles that are kept. */
static uint32_t terrimpi_atlas_free_most(const terrimp_live_atlas_desc *desc)
{
    return 6u * desc->max_slots + 64u;
}

static terrimp_rect terrimpi_atlas_whole(const terrimp_live_atlas *atlas)
{
    return terrimpi_rect(0, 0, atlas->desc.width + atlas->desc.padding,
                         atlas->desc.height + atlas->desc.padding);
}

static terrimp_rect terrimpi_atlas_padded(const terrimp_live_atlas *atlas, uint32_t slot)
{
    terrimp_rect rect = atlas->slots[slot];
    rect.width += atlas->desc.padding;
    rect.height += atlas->desc.padding;
    return rect;
}

static int terrimpi_atlas_desc_ok(const terrimp_live_atlas_desc *desc)
{
    return terrimpi_within_u32(desc->width, 1u, 32768u) && desc->padding <= 1024u &&
           terrimpi_within_u32(desc->height, 1u, 32768u) &&
           terrimpi_within_u32(desc->max_slots, 1u, 65536u);
}

TERRIMP_API size_t terrimp_live_atlas_bytes(const terrimp_live_atlas_desc *desc)
{
    if (!desc || !terrimpi_atlas_desc_ok(desc))
        return 0;
    return ((size_t)desc->max_slots + terrimpi_atlas_free_most(desc)) * sizeof(terrimp_rect);
}

static void terrimpi_atlas_reset(terrimp_live_atlas *atlas)
{
    uint32_t i;
    for (i = 0; i < atlas->desc.max_slots; i++)
        atlas->slots[i] = terrimpi_rect(i + 1u, 0, 0, 0);
    atlas->free_rects[0] = terrimpi_atlas_whole(atlas);
    atlas->free_count = 1;
    atlas->unused = atlas->slot_end = 0;
    atlas->slot_count = atlas->texels_used = atlas->failures = 0;
}

/* Sets an atlas up, without its first reset. */
static void terrimpi_atlas_init(terrimp_live_atlas *atlas, const terrimp_live_atlas_desc *desc,
                                void *memory)
{
    atlas->desc = *desc;
    atlas->slots = (terrimp_rect *)memory;
    atlas->free_rects = atlas->slots + desc->max_slots;
    atlas->max_free = terrimpi_atlas_free_most(desc);
}

TERRIMP_API terrimp_result terrimp_live_atlas_init(terrimp_live_atlas *atlas,
                                                   const terrimp_live_atlas_desc *desc,
                                                   void *memory, size_t bytes)
{
    TERRIMPI_REFUSE(!atlas || !desc || !memory, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_atlas_desc_ok(desc), TERRIMP_E_RANGE);
    TERRIMPI_REFUSE((uintptr_t)memory % 8u != 0, TERRIMP_E_ALIGN);
    TERRIMPI_REFUSE(bytes < terrimp_live_atlas_bytes(desc), TERRIMP_E_MEMORY);
    terrimpi_atlas_init(atlas, desc, memory);
    terrimpi_atlas_reset(atlas);
    return TERRIMP_OK;
}

/* The smallest free rectangle that a size fits into, the first of equals; free_count for none. */
static uint32_t terrimpi_atlas_find(const terrimp_live_atlas *atlas, uint32_t width,
                                    uint32_t height)
{
    uint32_t i, best = atlas->free_count, best_area = 0xffffffffu;
    if (width > atlas->desc.width || height > atlas->desc.height)
        return best;
    width += atlas->desc.padding;
    height += atlas->desc.padding;
    for (i = 0; i < atlas->free_count; i++) {
        const terrimp_rect *spot = &atlas->free_rects[i];
        if (spot->width >= width && spot->height >= height &&
            spot->width * spot->height < best_area) {
            best = i;
            best_area = spot->width * spot->height;
        }
    }
    return best;
}

/* Length that the ranges [a, a + a_size] and [b, b + b_size] have in common. */
static TERRIMPI_CALL uint32_t terrimpi_atlas_shared(uint32_t a, uint32_t a_size, uint32_t b,
                                                    uint32_t b_size)
{
    uint32_t low = terrimpi_max_u32(a, b), high = terrimpi_min_u32(a + a_size, b + b_size);
    return high > low ? high - low : 0u;
}

/* How much of a place's outline lies at slots or at the rim of the atlas. */
static uint32_t terrimpi_atlas_contact(const terrimp_live_atlas *atlas, const terrimp_rect *place)
{
    terrimp_rect whole = terrimpi_atlas_whole(atlas);
    uint32_t i, right = place->x + place->width, top = place->y + place->height, length = 0;
    length += (place->x == 0 ? place->height : 0u) + (right == whole.width ? place->height : 0u);
    length += (place->y == 0 ? place->width : 0u) + (top == whole.height ? place->width : 0u);
    for (i = 0; i < atlas->slot_end; i++) {
        terrimp_rect slot = terrimpi_atlas_padded(atlas, i);
        if (atlas->slots[i].width == 0)
            continue;
        if (slot.x == right || slot.x + slot.width == place->x)
            length += terrimpi_atlas_shared(slot.y, slot.height, place->y, place->height);
        if (slot.y == top || slot.y + slot.height == place->y)
            length += terrimpi_atlas_shared(slot.x, slot.width, place->x, place->width);
    }
    return length;
}

/* The corner of a free rectangle where a padded size touches most: what stays free is in one piece
   there. */
static terrimp_rect terrimpi_atlas_corner(const terrimp_live_atlas *atlas, const terrimp_rect *spot,
                                          uint32_t width, uint32_t height)
{
    terrimp_rect best = terrimpi_rect(spot->x, spot->y, width, height);
    uint32_t corner, most = 0;
    for (corner = 0; corner < 4u; corner++) {
        terrimp_rect place = terrimpi_rect(spot->x, spot->y, width, height);
        uint32_t length;
        place.x += corner & 1u ? spot->width - width : 0u;
        place.y += corner & 2u ? spot->height - height : 0u;
        length = terrimpi_atlas_contact(atlas, &place);
        if (length > most) {
            most = length;
            best = place;
        }
    }
    return best;
}

TERRIMP_API terrimp_result terrimp_live_atlas_alloc(terrimp_live_atlas *atlas, uint32_t width,
                                                    uint32_t height, uint32_t *slot)
{
    uint32_t spot, handle;
    terrimp_rect taken, whole;
    TERRIMPI_REFUSE(!atlas || !slot, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!atlas->slots, TERRIMP_E_STATE);
    TERRIMPI_REFUSE(width < 1u || height < 1u, TERRIMP_E_RANGE);
    spot = terrimpi_atlas_find(atlas, width, height);
    handle = atlas->unused;
    if (spot == atlas->free_count || handle == atlas->desc.max_slots) {
        atlas->failures++;
        return TERRIMP_E_CAPACITY;
    }
    taken = terrimpi_atlas_corner(atlas, &atlas->free_rects[spot], width + atlas->desc.padding,
                                  height + atlas->desc.padding);
    atlas->unused = atlas->slots[handle].x;
    atlas->slots[handle] = terrimpi_rect(taken.x, taken.y, width, height);
    atlas->slot_end = terrimpi_max_u32(atlas->slot_end, handle + 1u);
    atlas->slot_count++;
    atlas->texels_used += width * height;
    whole = terrimpi_atlas_whole(atlas);
    terrimpi_atlas_free_cut(atlas, 0, &taken, &whole);
    *slot = handle;
    return TERRIMP_OK;
}

/* Adds the free rectangles that overlap `freed`, which is no slot any more. They replace those
   that they contain, which touch it. */
static void terrimpi_atlas_reclaim(terrimp_live_atlas *atlas, const terrimp_rect *freed)
{
    uint32_t i, first = terrimpi_atlas_free_part(atlas, 0, freed), old = atlas->free_count;
    int beside;
    /* There is memory for one more: what was cut last has left its place. */
    atlas->free_rects[atlas->free_count++] = terrimpi_atlas_whole(atlas);
    /* What lies beside, above or below cuts most: with it first, the list stays short. */
    for (beside = 1; beside >= 0; beside--)
        for (i = 0; i < atlas->slot_end; i++) {
            terrimp_rect taken = terrimpi_atlas_padded(atlas, i);
            if (atlas->slots[i].width > 0 &&
                beside == (terrimpi_atlas_shared(taken.x, taken.width, freed->x,
                                                 freed->width) > 0 ||
                           terrimpi_atlas_shared(taken.y, taken.height, freed->y,
                                                 freed->height) > 0))
                terrimpi_atlas_free_cut(atlas, old, &taken, freed);
        }
    terrimpi_atlas_free_mark(atlas, first, old, old);
    terrimpi_atlas_free_compact(atlas, first);
}

TERRIMP_API terrimp_result terrimp_live_atlas_free(terrimp_live_atlas *atlas, uint32_t slot)
{
    terrimp_rect freed;
    TERRIMPI_REFUSE(!atlas, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!atlas->slots, TERRIMP_E_STATE);
    TERRIMPI_REFUSE(slot >= atlas->desc.max_slots, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(atlas->slots[slot].width == 0, TERRIMP_E_STATE);
    freed = terrimpi_atlas_padded(atlas, slot);
    atlas->texels_used -= atlas->slots[slot].width * atlas->slots[slot].height;
    atlas->slot_count--;
    atlas->slots[slot] = terrimpi_rect(atlas->unused, 0, 0, 0);
    atlas->unused = slot;
    terrimpi_atlas_reclaim(atlas, &freed);
    return TERRIMP_OK;
}

/* ==== Terrain ============================================================ >>impl-terrain */
/* Based on: Hess 2010, sections 3.1, 4.2 and 6.5 (coarse meshes, skirts, meshes for many chunks);
   de Boer 2000, section 2.2 (quadtree).

   What is built stands in four arrays of 32-bit words with a fixed share for each node and without
   any pointer: so nodes can be built in any order, and the arrays can lie in read-only memory and
   change their byte order (room Bake). */

#define TERRIMPI_TERRAIN_DIRECTIONS 8u           /* neighbours of a node */
#define TERRIMPI_TERRAIN_COLUMN 14u      /* quads that are written side by side */
#define TERRIMPI_FLOOR_QUADS 32u         /* along a side of the floor at most: 2048 triangles */
#define TERRIMPI_FLOOR_WALL_POINTS 4u          /* of the walls round it, for each of these */
#define TERRIMPI_MESH_UNDER (1.0f / 8192.0f) /* of a node's side: see terrimpi_mesh_under */
#define TERRIMPI_MESH_BORDER_STEPS 0x3fffffu  /* of the heights of borders */
#define TERRIMPI_MESH_INNER_STEPS 0xffffu     /* of those of inner vertices */

/* What is kept of a node's coarse mesh. Skirts are not stored: they follow from the border loop. */
typedef struct terrimpi_mesh {
    float error, error_rms; /* [wu] of the mesh as drawn, against every sample */
    float base;             /* [wu] the heights of inner vertices count from it on */
    float low, high;        /* [wu] of its surface, the ground, and those of the nodes below */
    uint32_t counts;        /* 9 bits: triangles; 7: vertices of the border; 8: of the surface, 0 if
                               it is not built; 8: the exponent of the steps of inner heights */
} terrimpi_mesh;

/* A vertex of it. Column and row count in steps of 2^level samples within the node; the last ones
   stand for its last column and row. Inner ones are stored as 8 bits of column, 8 of row and 16 of
   height, in steps of the node's own: one extreme sample spoils only the nodes that hold it. Those
   of borders have to meet those of neighbours to the bit: 8 bits along the side, 2 for which side,
   and 22 of height, in steps of the terrain. */
typedef struct terrimpi_mesh_point_steps {
    uint32_t x, z;
    float height;
} terrimpi_mesh_point_steps;

/* What a page's record has beside heights and errors of the ground, which it begins with. */
typedef struct terrimpi_record {
    terrimp_geomip_node ground;
    terrimpi_mesh mesh;
    float held; /* the largest of its rms and of what its children ask for, see
                   terrimpi_page_held_by: what PICTURE asks of a node for those below it */
} terrimpi_record;

struct terrimp_terrain {
    uint32_t border_limit, vertex_limit, index_limit; /* of one surface; the last ones are kept */
    uint32_t vertex_stride, index_stride;  /* of the host's buffers */
    uint32_t mesh_triangle_count;          /* all nodes */
    uint32_t floor_level;                  /* level whose nodes are the floor's quads */
    uint32_t skirt_level;                  /* from it on ground has skirts at the outer border */
    float sample_low, sample_high;         /* [wu] between these all samples lie */
    float range_low, range_step;           /* [wu] heights of borders: low + step * 0..2^22 - 1 */
    uint16_t begun, built, baked;
    terrimpi_mesh *meshes;                 /* [node_count] */
    uint32_t *points;                      /* [node_count][vertex_limit] */
    uint32_t *corners;                     /* [node_count][index_limit / 4] four indices each */
    uint32_t *stale;                       /* a bit for each node that edits have left; NULL for a
                                              bake: none */
    uint32_t *real;                        /* [node_count] of a view of one that wraps: the node of
                                              which a node is a repetition. NULL: itself */
    uint32_t tiles;                        /* then: repetitions along each axis */
    const terrimp_endless *endless;
    uint32_t coarse, cut_x, cut_z;         /* while pages above blocks are made: it is of every
                                              2^coarse-th sample, the last ones closer by so many */
    terrimp_terrain_desc desc; /* resolved */
    terrimp_quadtree tree;
#ifndef TERRIMP_NO_MALLOC
    terrimp_allocator allocator;           /* of create; release is NULL otherwise */
    size_t bytes;
#endif
};

/* Writes the triangles of a wall along a loop of n vertices, whose rim is the vertices from
   `rim` on. Facing outwards with the rim below, or inwards with the rim above. */
static void terrimpi_terrain_write_wall(uint16_t *t, uint32_t n, uint32_t rim, int inwards)
{
    uint32_t i;
    for (i = 0; i < n; i++) {
        uint16_t p = (uint16_t)i, q = (uint16_t)((i + 1) % n);
        uint16_t p_rim = (uint16_t)(rim + p), q_rim = (uint16_t)(rim + q);
        *t++ = inwards ? q : p;
        *t++ = inwards ? p : p_rim;
        *t++ = inwards ? p_rim : q_rim;
        *t++ = inwards ? q : p;
        *t++ = inwards ? p_rim : q_rim;
        *t++ = inwards ? q_rim : q;
    }
}

TERRIMP_API terrimp_result terrimp_terrain_desc_resolve(const terrimp_terrain_desc *desc,
                                                        terrimp_terrain_desc *out)
{
    terrimp_terrain_desc d;
    TERRIMPI_REFUSE(!desc || !out, TERRIMP_E_NULL);
    d = *desc;
    TERRIMPI_TRY(terrimp_heightfield_resolve(&d.field, &d.field));
    TERRIMPI_REFUSE(!terrimpi_finite(d.proud) || !terrimpi_finite2(d.height_low, d.height_high),
                    TERRIMP_E_NOT_FINITE);
    TERRIMPI_DEFAULT(d.chunk_quads, 64u);
    TERRIMPI_DEFAULT(d.triangle_budget, TERRIMP_TRIANGLE_BUDGET);
    TERRIMPI_DEFAULT(d.proud, 1.0f);
    d.proud = d.not_proud ? 0.0f : d.proud;
    TERRIMPI_REFUSE(!terrimpi_tree_quads_fit(d.chunk_quads) ||
                    !terrimpi_within_u32(d.triangle_budget, 32u, 400u) ||
                    !terrimpi_within(d.proud, 0.0f, 1.0f) || d.height_low > d.height_high,
                    TERRIMP_E_RANGE);
    *out = d;
    return TERRIMP_OK;
}

#ifndef TERRIMP_NO_TROUBLE

TERRIMP_API const char *terrimp_terrain_desc_trouble(const terrimp_terrain_desc *desc)
{
    static const terrimpi_trouble_field fields[] = {
        TERRIMPI_TROUBLE(terrimp_terrain_desc, chunk_quads),
        TERRIMPI_TROUBLE(terrimp_terrain_desc, triangle_budget),
        TERRIMPI_TROUBLE(terrimp_terrain_desc, proud),
        TERRIMPI_TROUBLE(terrimp_terrain_desc, height_low),
        TERRIMPI_TROUBLE(terrimp_terrain_desc, height_high)
    };
    terrimp_terrain_desc good, bad;
    if (!desc)
        return "the descriptor";
    if (terrimp_heightfield_trouble(&desc->field))
        return terrimp_heightfield_trouble(&desc->field);
    memset(&good, 0, sizeof good);
    bad = *desc;
    TERRIMPI_FIND_TROUBLE(fields, good, bad, terrimp_terrain_desc_resolve(&bad, &bad));
}

#endif /* TERRIMP_NO_TROUBLE */

/* Segments of a side of the outer border as ground of a level has them. */
static uint32_t terrimpi_skirt_segments(const terrimp_terrain *t, uint32_t level, uint32_t side)
{
    uint32_t samples = terrimpi_along_x((int)side) ? t->desc.field.width : t->desc.field.depth;
    return ((samples - 2u) >> level) + 1u;
}

/* How many segments the skirts have before those of a level's side. */
static uint32_t terrimpi_skirt_before(const terrimp_terrain *t, uint32_t level, uint32_t side)
{
    uint32_t i, before = 0;
    for (i = TERRIMP_SIDE_COUNT * t->skirt_level; i < TERRIMP_SIDE_COUNT * level + side; i++)
        before += terrimpi_skirt_segments(t, i / TERRIMP_SIDE_COUNT, i % TERRIMP_SIDE_COUNT);
    return before;
}

/* How many vertices, indices and points of the walls the floor has; in all, with the skirts of
   ground behind it. */
typedef struct terrimpi_floor {
    uint32_t ground_vertices, ground_indices, wall_points;
    uint32_t skirt_vertex, skirt_index, vertices, indices;
} terrimpi_floor;

static terrimpi_floor terrimpi_floor_of(const terrimp_terrain *t)
{
    uint32_t wide = t->tree.level_x[t->floor_level], deep = t->tree.level_z[t->floor_level];
    uint32_t skirts = terrimpi_skirt_before(t, t->tree.level_count, 0);
    terrimpi_floor f;
    f.ground_vertices = (wide + 1u) * (deep + 1u);
    f.ground_indices = 6u * wide * deep;
    f.wall_points = 2u * TERRIMPI_FLOOR_WALL_POINTS * (wide + deep);
    f.skirt_vertex = f.ground_vertices + 2u * f.wall_points;
    f.skirt_index = f.ground_indices + 6u * f.wall_points;
    f.vertices = f.skirt_vertex + 4u * skirts;
    f.indices = f.skirt_index + 6u * skirts;
    return f;
}

/* Inner points that a border keeps: those of 64 quads are the simplifier's default, and a budget
   that is larger or smaller moves them along, since a mesh's triangles go with the square. */
static uint32_t terrimpi_terrain_border_points(uint32_t budget)
{
    uint32_t points = 1;
    while ((points + 1u) * (points + 1u) * TERRIMP_TRIANGLE_BUDGET <=
           TERRIMP_BORDER_POINTS * TERRIMP_BORDER_POINTS * budget)
        points++;
    return points;
}

/* Works out all numbers that follow from a resolved descriptor. Returns 0 when the host's buffers
   would be too large to be counted. */
static int terrimpi_terrain_count(terrimp_terrain *t)
{
    uint32_t budget = t->desc.triangle_budget, skirts;
    int ok = 1;
    skirts = t->desc.no_lower_skirts ? 0u : 1u;
    terrimp_quadtree_init(&t->desc.field, t->desc.chunk_quads, &t->tree);
    /* A surface of n triangles whose border has b vertices has (n + b + 2) / 2 vertices in all. */
    t->border_limit = 4u * (terrimpi_terrain_border_points(budget) + 1u);
    t->vertex_limit = (budget + t->border_limit + 2u) / 2u;
    t->index_limit = (3u * budget + 3u) / 4u * 4u;
    t->vertex_stride = t->vertex_limit + skirts * t->border_limit;
    t->index_stride = 3u * budget + skirts * 6u * t->border_limit;
    t->floor_level = 0;
    while (terrimpi_max_u32(t->tree.level_x[t->floor_level], t->tree.level_z[t->floor_level]) >
           TERRIMPI_FLOOR_QUADS)
        t->floor_level++;
    t->skirt_level = 1;
    while (t->skirt_level < t->tree.level_count && terrimpi_floor_of(t).vertices > 0x10000u)
        t->skirt_level++;
    (void)terrimpi_mul(t->tree.node_count + 3u, t->index_stride * sizeof(float), &ok);
    return ok && t->tree.node_count < 0xffffffffu / t->index_stride - 3u;
}

/* The one description of what is built: sets the arrays when there is a base. Returns the bytes, 0
   on overflow. */
static size_t terrimpi_terrain_layout(terrimp_terrain *t, unsigned char *base)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    size_t count;
    b.ok = terrimpi_terrain_count(t);
    count = t->tree.node_count;
    t->tree.nodes = (terrimp_geomip_node *)terrimpi_take(&b, count, sizeof *t->tree.nodes);
    t->meshes = (terrimpi_mesh *)terrimpi_take(&b, count, sizeof *t->meshes);
    t->points = (uint32_t *)terrimpi_take(&b, count, t->vertex_limit * sizeof *t->points);
    t->corners = (uint32_t *)terrimpi_take(&b, count, t->index_limit);
    return b.ok ? b.bytes : 0;
}

/* Where a node lies: its first sample, how many quads of the field it spans, and its tile of every
   2^level-th sample, whose last column and row are the node's last. */
typedef struct terrimpi_terrain_tile {
    uint32_t level, x, z, span_x, span_z;
    uint32_t cols, rows;
    uint32_t coarse, cut_x, cut_z; /* as those of the terrain, of its own last column and row */
} terrimpi_terrain_tile;

static terrimpi_terrain_tile terrimpi_terrain_tile_of(const terrimp_terrain *t, uint32_t node)
{
    terrimp_node place = terrimpi_tree_node(&t->tree, node);
    uint32_t quads = t->desc.chunk_quads;
    terrimpi_terrain_tile p;
    p.level = place.level;
    p.x = terrimpi_tree_col(&t->tree, p.level, place.x * quads);
    p.z = terrimpi_tree_row(&t->tree, p.level, place.z * quads);
    p.span_x = terrimpi_tree_col(&t->tree, p.level, (place.x + 1u) * quads) - p.x;
    p.span_z = terrimpi_tree_row(&t->tree, p.level, (place.z + 1u) * quads) - p.z;
    p.cols = ((p.span_x - 1u) >> p.level) + 2u;
    p.rows = ((p.span_z - 1u) >> p.level) + 2u;
    p.coarse = t->coarse;
    p.cut_x = p.x + p.span_x + 1u == t->tree.field.width ? t->cut_x : 0u;
    p.cut_z = p.z + p.span_z + 1u == t->tree.field.depth ? t->cut_z : 0u;
    return p;
}

/* World x of a column and z of a row; beyond the far edge, of the last ones. */
static float terrimpi_terrain_x(const terrimp_terrain *t, uint32_t column)
{
    return terrimpi_tree_x(&t->tree, 0, column);
}

static float terrimpi_terrain_z(const terrimp_terrain *t, uint32_t row)
{
    return terrimpi_tree_z(&t->tree, 0, row);
}

static const terrimpi_mesh *terrimpi_mesh_of(const terrimp_terrain *t, uint32_t node)
{
    if (t->meshes)
        return &t->meshes[node];
    return &((const terrimpi_record *)(const void *)terrimpi_tree_record(&t->tree, node))->mesh;
}

/* The node of the built terrain that a node is, or repeats. */
static uint32_t terrimpi_real_node(const terrimp_terrain *t, uint32_t node)
{
    return t->real ? t->real[node] : node;
}

/* The stored vertices of a node's mesh, and behind them the words with its indices. */
static const uint32_t *terrimpi_points_of(const terrimp_terrain *t, uint32_t node)
{
    if (t->points)
        return t->points + (size_t)terrimpi_real_node(t, node) * t->vertex_limit;
    return (const uint32_t *)(const void *)(terrimpi_page_of(t->tree.pages, node) +
                                            TERRIMPI_PAGE_CHILDREN + 4u * TERRIMPI_PAGE_RECORD);
}

static const uint32_t *terrimpi_corners_of(const terrimp_terrain *t, uint32_t node)
{
    return t->corners ? t->corners + (size_t)terrimpi_real_node(t, node) * (t->index_limit / 4u)
                      : terrimpi_points_of(t, node) + t->vertex_limit;
}

static uint32_t terrimpi_mesh_triangles(const terrimpi_mesh *mesh)
{
    return mesh->counts & 0x1ffu;
}

static uint32_t terrimpi_mesh_border(const terrimpi_mesh *mesh)
{
    return mesh->counts >> 9 & 0x7fu;
}

/* By how many levels ground beside a mesh may be coarser than it: over the lines of such ground its
   border is lifted. Two, where these are short beside the border. (With two at chunks of 16 AUTO
   costs a quarter more over hills. With one at chunks of 64, where impostors are then kept from
   being smaller than the ground's nodes, 30 to 50 % more at 4 px, for 0.7 to 1.6 dB less.) */
static uint32_t terrimpi_mesh_lift(uint32_t chunk_quads) { return chunk_quads >= 64u ? 2u : 1u; }

static uint32_t terrimpi_mesh_vertices(const terrimpi_mesh *mesh)
{
    return mesh->counts >> 16 & 0xffu;
}

/* The step of a mesh's inner heights: a power of two, or 0. */
static float terrimpi_mesh_step(const terrimpi_mesh *mesh)
{
    uint32_t bits = mesh->counts >> 24 << 23;
    float step;
    memcpy(&step, &bits, sizeof step);
    return step;
}

/* The height that a number of steps stands for, on a border. */
static float terrimpi_terrain_border_height(const terrimp_terrain *t, uint32_t steps)
{
    return t->range_low + t->range_step * (float)steps;
}

/* What a view does with a terrain that wraps: see terrimp_view_endless. */
struct terrimp_endless {
    int (*fits)(const terrimp_terrain *built, const terrimp_view_desc *desc);
    void (*begin)(const terrimp_terrain *built, uint32_t tiles, terrimp_terrain *t);
    terrimp_terrain *(*layout)(terrimp_terrain *t, const terrimp_terrain *built, terrimpi_arena *l);
    void (*fill)(terrimp_terrain *t, const terrimp_terrain *built);
    void (*enter)(terrimp_view *v, terrimp_camera *camera, float middle[2]);
    terrimp_node (*place)(const terrimp_terrain *t, const terrimp_node *node,
                          const float middle[2], float offset[2]);
};

/* The node whose vertices the host has for a node, and what these are moved by in its world.
   `middle` is where the repetition in the middle is. */
static terrimp_node terrimpi_real_place(const terrimp_terrain *t, const terrimp_node *node,
                                        const float middle[2], float offset[2])
{
    return t->real ? t->endless->place(t, node, middle, offset) : *node;
}

/* Says in a command which node that is: the same names in those of all kinds. */
#define TERRIMPI_COMMAND_NODE(command, place)                                                  \
    ((command)->node = (place).number, (command)->level = (place).level,                     \
     (command)->x = (place).x, (command)->z = (place).z)

/* Vertex i of a node's mesh. */
static terrimpi_mesh_point_steps terrimpi_mesh_point(const terrimp_terrain *t,
                                                     const terrimpi_terrain_tile *p,
                                                     uint32_t node, uint32_t i)
{
    const terrimpi_mesh *mesh = terrimpi_mesh_of(t, node);
    uint32_t word = terrimpi_points_of(t, node)[i];
    terrimpi_mesh_point_steps point;
    point.x = word & 0xffu;
    point.z = word >> 8 & 0xffu;
    if (i < terrimpi_mesh_border(mesh)) {
        uint32_t side = point.z & 3u;
        point.height = terrimpi_terrain_border_height(t, word >> 10);
        point.z = terrimpi_along_x((int)side) ? side & 1u ? p->rows - 1u : 0u : point.x;
        point.x = terrimpi_along_x((int)side) ? point.x : side & 1u ? p->cols - 1u : 0u;
    } else {
        point.height = mesh->base + terrimpi_mesh_step(mesh) * (float)(word >> 16);
    }
    return point;
}

/* Index i of a node's mesh. */
static uint32_t terrimpi_mesh_corner(const terrimp_terrain *t, uint32_t node, uint32_t i)
{
    return terrimpi_corners_of(t, node)[i / 4u] >> i % 4u * 8u & 0xffu;
}

/* Whether a range of heights does not overflow, nor squared errors that are summed up over all
   samples. */
static int terrimpi_terrain_range_fits(const terrimp_heightfield *field, float low, float step)
{
    float range = step * (float)TERRIMPI_MESH_BORDER_STEPS;
    return step >= 0.0f && terrimpi_finite(low) && terrimpi_finite(low + range) &&
           terrimpi_finite(range * range * (float)field->width * (float)field->depth);
}

/* ---- what has been built ---- */

/* What all that give something of a node have to check. */
static terrimp_result terrimpi_terrain_check_node(const terrimp_terrain *terrain, uint32_t node,
                                                  const void *out)
{
    TERRIMPI_REFUSE(!terrain || !out, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    TERRIMPI_REFUSE(node >= terrain->tree.node_count, TERRIMP_E_RANGE);
    return terrimpi_tree_kept(&terrain->tree, node) ? TERRIMP_OK : TERRIMP_E_PAGE;
}

/* The same for what only a node's page has. */
static terrimp_result terrimpi_check_page(const terrimp_terrain *terrain, uint32_t node,
                                          const void *out)
{
    TERRIMPI_TRY(terrimpi_terrain_check_node(terrain, node, out));
    return terrimpi_tree_opens(&terrain->tree, node) ? TERRIMP_OK : TERRIMP_E_PAGE;
}

/* How far the skirts of a level's meshes end below all ground, and their borders are over it: see
   terrimpi_mesh_skirt_foot, terrimpi_build_lift_border. */
static TERRIMPI_CALL float terrimpi_mesh_under(const terrimp_terrain *t, uint32_t level)
{
    return TERRIMPI_MESH_UNDER * (float)(t->desc.chunk_quads << level) *
           terrimpi_min(t->desc.field.spacing_x, t->desc.field.spacing_z);
}

/* The box of a node with the heights of a mesh: that of the node or of one above it. */
static void terrimpi_terrain_mesh_box(const terrimp_terrain *t, const terrimp_node *node,
                                      const terrimpi_mesh *mesh, terrimp_box *box)
{
    terrimpi_tree_box(&t->tree, node, mesh->low - terrimpi_mesh_under(t, node->level), mesh->high,
                      box);
}

/* The box of a node: of everything drawn of it and of those below it. */
static void terrimpi_terrain_node_box(const terrimp_terrain *t, const terrimp_node *node,
                                      terrimp_box *box)
{
    terrimpi_terrain_mesh_box(t, node, terrimpi_mesh_of(t, node->number), box);
}

TERRIMP_API terrimp_result terrimp_terrain_get_box(const terrimp_terrain *terrain, uint32_t node,
                                                   terrimp_box *box)
{
    terrimp_node place;
    TERRIMPI_TRY(terrimpi_terrain_check_node(terrain, node, box));
    place = terrimpi_tree_node(&terrain->tree, node);
    terrimpi_terrain_node_box(terrain, &place, box);
    return TERRIMP_OK;
}

/* How many meshes the host's buffers have room for, and which place is a node's. */
static uint32_t terrimpi_mesh_places(const terrimp_terrain *t)
{
    return t->tree.pages ? t->tree.pages->slot_count : t->tree.node_count;
}

static uint32_t terrimpi_mesh_at(const terrimp_terrain *t, uint32_t node)
{
    return t->tree.pages ? t->tree.pages->slot_of[node] - 1u : terrimpi_real_node(t, node);
}

/* Where a node's mesh stands in the host's buffers, and how good it is. */
static void terrimpi_mesh_place(const terrimp_terrain *t, uint32_t node, terrimp_mesh_info *info)
{
    const terrimpi_mesh *mesh = terrimpi_mesh_of(t, node);
    uint32_t rim = t->desc.no_lower_skirts ? 0u : terrimpi_mesh_border(mesh);
    info->base_vertex = terrimpi_mesh_at(t, node) * t->vertex_stride;
    info->vertex_count = terrimpi_mesh_vertices(mesh) + rim;
    info->first_index = terrimpi_mesh_at(t, node) * t->index_stride;
    info->triangle_count = terrimpi_mesh_triangles(mesh);
    info->index_count = 3u * info->triangle_count + 6u * rim;
    info->error = mesh->error;
    info->error_rms = mesh->error_rms;
}

TERRIMP_API terrimp_result terrimp_terrain_get_mesh(const terrimp_terrain *terrain, uint32_t node,
                                                    terrimp_mesh_info *mesh)
{
    TERRIMPI_TRY(terrimpi_check_page(terrain, node, mesh));
    terrimpi_mesh_place(terrain, node, mesh);
    return TERRIMP_OK;
}

/* ---- edits ---- */

static int terrimpi_terrain_stale(const terrimp_terrain *t, uint32_t node)
{
    node = terrimpi_real_node(t, node);
    return t->stale && (t->stale[node / 32u] >> node % 32u & 1u) != 0;
}

/* The nodes of a level that some samples belong to: columns and rows, first and last. */
typedef struct terrimpi_terrain_touched {
    uint32_t x0, z0, x1, z1;
} terrimpi_terrain_touched;

/* The nodes of a level that have one of `count` samples from `first` on, or one that is not more
   than `margin` beside them, along one axis of `samples` samples and `nodes` nodes. */
static void terrimpi_terrain_touched_along(uint32_t first, uint32_t count, uint32_t margin,
                                           uint32_t side,
                                           uint32_t samples, uint32_t nodes, uint32_t *from,
                                           uint32_t *to)
{
    uint32_t last = count > samples - first ? samples - 1u : first + count - 1u;
    first = first > margin ? first - margin : 0u;
    last = last < samples - 1u - terrimpi_min_u32(margin, samples - 1u) ? last + margin
                                                                        : samples - 1u;
    *from = first > 0 ? (first - 1u) / side : 0u; /* a border belongs to both of its nodes */
    *to = terrimpi_min_u32(last / side, nodes - 1u);
}

/* The same along both. */
static terrimpi_terrain_touched terrimpi_terrain_touched_within(const terrimp_quadtree *t,
                                                                const terrimp_rect *rect,
                                                                uint32_t level, uint32_t margin)
{
    uint32_t side = t->chunk_quads << level;
    terrimpi_terrain_touched out;
    terrimpi_terrain_touched_along(rect->x, rect->width, margin, side, t->field.width,
                                   t->level_x[level], &out.x0, &out.x1);
    terrimpi_terrain_touched_along(rect->y, rect->height, margin, side, t->field.depth,
                                   t->level_z[level], &out.z0, &out.z1);
    return out;
}

/* What vertices move by hangs on the triangles of two levels above; errors, and how far down skirts
   reach, on what a finer neighbour draws next to the border. */
static terrimpi_terrain_touched terrimpi_terrain_touched_nodes(const terrimp_terrain *t,
                                                               const terrimp_rect *rect,
                                                               uint32_t level, int morph)
{
    uint32_t margin = morph ? 4u << level : (1u << level) / 2u;
    if (t->tree.pages && level > t->tree.pages->block_level)
        margin += (t->desc.chunk_quads << level) / 2u; /* errors are of whole nodes beside it, see
                                                          terrimpi_paging_build */
    return terrimpi_terrain_touched_within(&t->tree, rect, level, margin);
}

static terrimp_result terrimpi_terrain_check_touched(const terrimp_terrain *t,
                                                     const terrimp_rect *rect)
{
    TERRIMPI_REFUSE(!t || !rect, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!t->built, TERRIMP_E_STATE);
    return terrimpi_field_has(&t->desc.field, rect) ? TERRIMP_OK : TERRIMP_E_RANGE;
}

TERRIMP_API terrimp_result terrimp_terrain_touched(const terrimp_terrain *terrain,
                                                   const terrimp_rect *samples, int morph,
                                                   uint32_t *nodes, uint32_t capacity,
                                                   uint32_t *count)
{
    uint32_t level, x, z, all = 0;
    TERRIMPI_REFUSE(!count, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_terrain_check_touched(terrain, samples));
    for (level = 0; level < terrain->tree.level_count; level++) {
        terrimpi_terrain_touched in = terrimpi_terrain_touched_nodes(terrain, samples, level,
                                                                     morph);
        all += (in.x1 - in.x0 + 1u) * (in.z1 - in.z0 + 1u);
    }
    *count = all;
    TERRIMPI_REFUSE(nodes && all > capacity, TERRIMP_E_CAPACITY);
    for (level = 0; nodes && level < terrain->tree.level_count; level++) {
        terrimpi_terrain_touched in = terrimpi_terrain_touched_nodes(terrain, samples, level,
                                                                     morph);
        for (z = in.z0; z <= in.z1; z++)
            for (x = in.x0; x <= in.x1; x++)
                *nodes++ = terrimpi_tree_at(&terrain->tree, level, x, z).number;
    }
    return TERRIMP_OK;
}

/* ---- the shared index buffer: geomip patterns, then rectangles of quads for captures ---- */

typedef struct terrimpi_terrain_pattern {
    uint32_t first_index, index_count;
    uint32_t triangle_count;
    uint32_t x0, z0, x1, z1; /* quads */
} terrimpi_terrain_pattern;

/* Widths of the strips of neighbours that a capture can draw: a 16th of the node, then twice as
   many quads each time, then the whole neighbour. */
static uint32_t terrimpi_terrain_apron_quads(uint32_t chunk_quads, uint32_t width)
{
    uint32_t quads = terrimpi_max_u32(1u, chunk_quads / 16u) << width;
    return terrimpi_min_u32(quads, chunk_quads);
}

static uint32_t terrimpi_terrain_apron_count(uint32_t chunk_quads)
{
    uint32_t count = 0;
    while (terrimpi_terrain_apron_quads(chunk_quads, count) < chunk_quads)
        count++;
    return count;
}

/* The quads of a neighbour that lie within `strip` quads of the node, along one axis on which it is
   before (0), beside (1) or behind (2) the node. */
static void terrimpi_terrain_apron_span(uint32_t place, uint32_t quads, uint32_t strip,
                                        uint32_t *from, uint32_t *to)
{
    *from = place == 0 ? quads - strip : 0;
    *to = place == 2u ? strip : quads;
}

/* Pattern 0 is the whole node, as geomip pattern 0; then come, for each strip width but the whole,
   the strips of the eight neighbours, behind all geomip patterns. Returns where pattern `wanted`
   stands, or with 0xffffffffu the end of all. */
static terrimpi_terrain_pattern terrimpi_terrain_pattern_of(uint32_t quads, uint32_t wanted)
{
    terrimpi_terrain_pattern p;
    uint32_t width, strip = 0, direction = (wanted - 1u) % TERRIMPI_TERRAIN_DIRECTIONS, k;
    p.x0 = p.z0 = p.first_index = 0;
    p.x1 = p.z1 = quads;
    p.index_count = terrimpi_mip_indices(quads, TERRIMP_FORM_LIST, 0);
    p.triangle_count = 2u * quads * quads;
    if (wanted == 0)
        return p;
    /* each of the 16 patterns as pattern 0, but half of the 64 sides coarse */
    p.first_index = 16u * p.index_count - 32u * 3u * (quads / 2u);
    p.index_count = p.triangle_count = 0;
    for (width = 0; width <= (wanted - 1u) / TERRIMPI_TERRAIN_DIRECTIONS; width++) {
        p.first_index += 24u * strip * (strip + quads); /* corners, and whole sides */
        strip = terrimpi_terrain_apron_quads(quads, width);
        if (strip == quads)
            return p;
    }
    for (k = 0; k <= direction; k++) {
        uint32_t cell = k < 4u ? k : k + 1u; /* of 3 x 3, row by row, without the middle */
        p.first_index += p.index_count;
        terrimpi_terrain_apron_span(cell % 3u, quads, strip, &p.x0, &p.x1);
        terrimpi_terrain_apron_span(cell / 3u, quads, strip, &p.z0, &p.z1);
        p.triangle_count = (p.x1 - p.x0) * (p.z1 - p.z0) * 2u;
        p.index_count = 3u * p.triangle_count;
    }
    return p;
}

/* Rows z0 to z1 of a column of pattern 0, which follow each other there. */
static terrimpi_terrain_pattern terrimpi_terrain_rows(uint32_t quads, uint32_t column, uint32_t z0,
                                                      uint32_t z1)
{
    terrimpi_terrain_pattern p;
    uint32_t k;
    p.x0 = terrimpi_mip_column(quads, column);
    p.x1 = terrimpi_mip_column(quads, column + 1u);
    p.z0 = z0;
    p.z1 = z1;
    p.first_index = 6u * (quads * p.x0 + z0 * (p.x1 - p.x0));
    for (k = 0; k <= column; k++)
        p.first_index += 3u * terrimpi_mip_ahead(quads, k);
    p.triangle_count = 2u * (p.x1 - p.x0) * (z1 - z0);
    p.index_count = 3u * p.triangle_count;
    return p;
}

/* The pattern of a neighbour's strip. */
static uint32_t terrimpi_terrain_apron_pattern(uint32_t quads, uint32_t width, uint32_t direction)
{
    return width < terrimpi_terrain_apron_count(quads) ? 1u + width * TERRIMPI_TERRAIN_DIRECTIONS +
        direction : 0u;
}

/* Writes the triangles of a rectangle of quads in columns, row by row within a column, so that a
   vertex cache of 16 entries still holds the row above. */
static void terrimpi_terrain_write_quads(uint16_t *out, const terrimpi_terrain_pattern *p,
                                         uint32_t row_vertices)
{
    uint32_t column, x, z;
    for (column = p->x0; column < p->x1; column += TERRIMPI_TERRAIN_COLUMN)
        for (z = p->z0; z < p->z1; z++)
            for (x = column; x < terrimpi_min_u32(column + TERRIMPI_TERRAIN_COLUMN, p->x1); x++) {
                uint16_t a = (uint16_t)(z * row_vertices + x), b = (uint16_t)(a + row_vertices);
                *out++ = a;
                *out++ = b;
                *out++ = (uint16_t)(b + 1u);
                *out++ = a;
                *out++ = (uint16_t)(b + 1u);
                *out++ = (uint16_t)(a + 1u);
            }
}

TERRIMP_API const terrimp_quadtree *terrimp_terrain_tree(const terrimp_terrain *terrain)
{
    return terrain && terrain->built ? &terrain->tree : NULL;
}

TERRIMP_API terrimp_result terrimp_terrain_get_info(const terrimp_terrain *terrain,
                                                    terrimp_terrain_info *info)
{
    const terrimp_quadtree *tree;
    terrimp_node root;
    uint32_t quads;
    TERRIMPI_REFUSE(!terrain || !info, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    tree = &terrain->tree;
    quads = terrain->desc.chunk_quads;
    info->chunk_quads = quads;
    info->chunks_x = tree->level_x[0];
    info->chunks_z = tree->level_z[0];
    info->level_count = tree->level_count;
    info->node_count = tree->node_count;
    info->ground_vertex_count = (quads + 1u) * (quads + 1u);
    info->ground_index_count = terrimpi_terrain_pattern_of(quads, 0xffffffffu).first_index;
    info->mesh_vertex_stride = terrain->vertex_stride;
    info->mesh_index_stride = terrain->index_stride;
    info->floor_vertex_count = terrimpi_floor_of(terrain).vertices;
    info->floor_index_count = terrimpi_floor_of(terrain).indices;
    info->mesh_vertex_count =
        terrimpi_mesh_places(terrain) * terrain->vertex_stride + info->floor_vertex_count;
    info->mesh_index_count =
        terrimpi_mesh_places(terrain) * terrain->index_stride + info->floor_index_count;
    info->mesh_triangle_count = terrain->mesh_triangle_count;
    root = terrimpi_tree_root(tree);
    terrimpi_terrain_node_box(terrain, &root, &info->box);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_terrain_fill_indices(const terrimp_terrain *terrain,
                                                        uint16_t *indices, size_t capacity)
{
    uint32_t quads, i, strips;
    TERRIMPI_REFUSE(!terrain || !indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    quads = terrain->desc.chunk_quads;
    TERRIMPI_REFUSE(capacity < terrimpi_terrain_pattern_of(quads, 0xffffffffu).first_index,
                    TERRIMP_E_CAPACITY);
    terrimp_pattern_fill(quads, TERRIMP_FORM_LIST, indices, capacity);
    strips = terrimpi_terrain_apron_count(quads) * TERRIMPI_TERRAIN_DIRECTIONS;
    for (i = 1; i <= strips; i++) {
        terrimpi_terrain_pattern p = terrimpi_terrain_pattern_of(quads, i);
        terrimpi_terrain_write_quads(indices + p.first_index, &p, quads + 1u);
    }
    return TERRIMP_OK;
}

static size_t terrimpi_terrain_ground_vertices(const terrimp_terrain *t)
{
    return (size_t)(t->desc.chunk_quads + 1u) * (t->desc.chunk_quads + 1u);
}

/* The samples of a page, [chunk_quads + 1]^2. */
static const void *terrimpi_page_samples(const terrimp_terrain *t, uint32_t node)
{
    return terrimpi_corners_of(t, node) + t->index_limit / 4u;
}

/* A page as a heightfield: what of it lies within the terrain. Beside the far edges the last quad
   is taken for a whole one. */
static terrimp_heightfield terrimpi_page_field(const terrimp_terrain *t, uint32_t node)
{
    terrimp_heightfield f = t->desc.field;
    terrimpi_terrain_tile p = terrimpi_terrain_tile_of(t, node);
    f.samples = terrimpi_page_samples(t, node);
    f.row_bytes = terrimpi_field_sample_bytes(f.format) * (t->desc.chunk_quads + 1u);
    f.origin_x = terrimpi_terrain_x(t, p.x);
    f.origin_z = terrimpi_terrain_z(t, p.z);
    f.spacing_x *= (float)(1u << p.level);
    f.spacing_z *= (float)(1u << p.level);
    f.width = p.cols;
    f.depth = p.rows;
    return f;
}

TERRIMP_API terrimp_result terrimp_terrain_fill_ground(const terrimp_terrain *terrain,
                                                       uint32_t node, float *xyz, size_t capacity)
{
    TERRIMPI_TRY(terrimpi_check_page(terrain, node, xyz));
    TERRIMPI_REFUSE(capacity < 3u * terrimpi_terrain_ground_vertices(terrain), TERRIMP_E_CAPACITY);
    return terrimp_geomip_fill_vertices(&terrain->tree, node, xyz, NULL);
}

TERRIMP_API terrimp_result terrimp_terrain_fill_morph(const terrimp_terrain *terrain,
                                                      uint32_t node,
                                                      terrimp_geomip_vertex *vertices,
                                                      size_t capacity)
{
    TERRIMPI_TRY(terrimpi_check_page(terrain, node, vertices));
    TERRIMPI_REFUSE(capacity < terrimpi_terrain_ground_vertices(terrain), TERRIMP_E_CAPACITY);
    return terrimp_geomip_fill_vertices(&terrain->tree, node, NULL, vertices);
}

/* Writes the floor's ground: a quad for each node of its level. A corner has the height of the
   lowest sample of the up to four nodes around it, so no quad rises over a sample of its node; and
   nodes share their corners, so it has no gap. */
static void terrimpi_floor_write_ground(const terrimp_terrain *t, float *xyz, uint16_t *indices)
{
    uint32_t level = t->floor_level, quads = t->desc.chunk_quads << level;
    uint32_t wide = t->tree.level_x[level], deep = t->tree.level_z[level], x, z, i, k;
    const terrimp_geomip_node *nodes = t->tree.nodes;
    terrimpi_terrain_pattern all;
    for (z = 0; z <= deep; z++)
        for (x = 0; x <= wide; x++) {
            float low = TERRIMPI_FLOAT_MAX;
            for (k = z ? z - 1u : 0; nodes && k <= terrimpi_min_u32(z, deep - 1u); k++)
                for (i = x ? x - 1u : 0; i <= terrimpi_min_u32(x, wide - 1u); i++)
                    low = terrimpi_min(low, nodes[t->tree.level_first[level] + k * wide + i].low);
            if (!nodes)
                low = t->tree.pages->lows[z * (wide + 1u) + x];
            *xyz++ = terrimpi_terrain_x(t, x * quads);
            *xyz++ = low;
            *xyz++ = terrimpi_terrain_z(t, z * quads);
        }
    memset(&all, 0, sizeof all);
    all.x1 = wide;
    all.z1 = deep;
    terrimpi_terrain_write_quads(indices, &all, wide + 1u);
}

/* The sample of point k of the floor's walls, round the outer border as round a mesh's. */
static void terrimpi_floor_wall_place(const terrimp_terrain *t, uint32_t k, uint32_t *x,
                                      uint32_t *z)
{
    uint32_t level = t->floor_level, quads = t->desc.chunk_quads << level;
    uint32_t along_x = t->tree.level_x[level] * TERRIMPI_FLOOR_WALL_POINTS;
    uint32_t along_z = t->tree.level_z[level] * TERRIMPI_FLOOR_WALL_POINTS, col, row;
    k %= 2u * (along_x + along_z);
    col = k < along_z                  ? 0
          : k < along_z + along_x      ? k - along_z
          : k < 2u * along_z + along_x ? along_x
                                       : 2u * (along_x + along_z) - k;
    row = k < along_z                  ? k
          : k < along_z + along_x      ? along_z
          : k < 2u * along_z + along_x ? 2u * along_z + along_x - k
                                       : 0;
    *x = terrimpi_min_u32(col * quads / TERRIMPI_FLOOR_WALL_POINTS, t->desc.field.width - 1u);
    *z = terrimpi_min_u32(row * quads / TERRIMPI_FLOOR_WALL_POINTS, t->desc.field.depth - 1u);
}

/* The samples below the walls from point k to the next one: one column or row. */
static terrimp_rect terrimpi_floor_wall(const terrimp_terrain *t, uint32_t k)
{
    uint32_t a[2], b[2], x, z;
    terrimpi_floor_wall_place(t, k, &a[0], &a[1]);
    terrimpi_floor_wall_place(t, k + 1u, &b[0], &b[1]);
    x = terrimpi_min_u32(a[0], b[0]);
    z = terrimpi_min_u32(a[1], b[1]);
    return terrimpi_rect(x, z, terrimpi_max_u32(a[0], b[0]) - x + 1u,
                         terrimpi_max_u32(a[1], b[1]) - z + 1u);
}

static float terrimpi_floor_lowest(const terrimp_terrain *t, uint32_t wall)
{
    float low, high;
    return terrimpi_field_range(&t->desc.field, terrimpi_floor_wall(t, wall), 0, &low, &high) ==
                   TERRIMP_OK ? low : t->sample_low;
}

/* The samples of quad i of the floor, of its ground or its walls, in the order of
   terrimpi_terrain_write_quads and terrimpi_terrain_write_wall; those of ground may reach over the
   last ones. */
static terrimp_rect terrimpi_floor_quad(const terrimp_terrain *t, uint32_t i)
{
    uint32_t level = t->floor_level, quads = t->desc.chunk_quads << level, first, width;
    uint32_t wide = t->tree.level_x[level], deep = t->tree.level_z[level];
    if (i >= wide * deep)
        return terrimpi_floor_wall(t, i - wide * deep);
    first = i / (TERRIMPI_TERRAIN_COLUMN * deep) * TERRIMPI_TERRAIN_COLUMN;
    width = terrimpi_min_u32(TERRIMPI_TERRAIN_COLUMN, wide - first);
    i -= first * deep;
    return terrimpi_rect((first + i % width) * quads, i / width * quads, quads + 1u, quads + 1u);
}

static float terrimpi_skirt_sample(const terrimp_heightfield *f, uint32_t along_x, uint32_t along,
                                   uint32_t across)
{
    return terrimpi_field_sample(f, along_x ? along : across, along_x ? across : along);
}

/* Writes the skirts of ground at the outer border, which face outwards: for each level, side and
   segment a quad. A segment of coarse ground may lie above the samples between its ends; its skirt
   hangs down to below them: no deeper than the deepest of them, and from each end no steeper than
   to the steepest. Else what comes in there, from beside, would be below the ground that it meets
   in truth, and leave through the back of it. */
static void terrimpi_skirts_write(const terrimp_terrain *t, float *xyz, uint16_t *indices,
                                  uint32_t vertex)
{
    const terrimp_heightfield *f = &t->desc.field;
    uint32_t line, i, k, c;
    for (line = TERRIMP_SIDE_COUNT * t->skirt_level;
         line < TERRIMP_SIDE_COUNT * t->tree.level_count; line++) {
        uint32_t level = line / TERRIMP_SIDE_COUNT, side = line % TERRIMP_SIDE_COUNT;
        uint32_t along_x = terrimpi_along_x((int)side) ? 1u : 0u, back = along_x != (side & 1u);
        uint32_t across = !(side & 1u) ? 0u : along_x ? f->depth - 1u : f->width - 1u;
        uint32_t last = along_x ? f->width - 1u : f->depth - 1u;
        for (i = 0; i < terrimpi_skirt_segments(t, level, side); i++, vertex += 4u) {
            uint32_t at[2];
            float ends[2][3], steepest[2] = {0.0f, 0.0f}, deepest = 0.0f;
            for (k = 0; k < 2u; k++) {
                at[k] = terrimpi_min_u32((i + k) << level, last);
                ends[k][0] = terrimpi_terrain_x(t, along_x ? at[k] : across);
                ends[k][1] = terrimpi_skirt_sample(f, along_x, at[k], across);
                ends[k][2] = terrimpi_terrain_z(t, along_x ? across : at[k]);
            }
            for (k = at[0] + 1u; k < at[1]; k++) {
                float way = (float)(k - at[0]) / (float)(at[1] - at[0]);
                float deep = ends[0][1] + (ends[1][1] - ends[0][1]) * way -
                             terrimpi_skirt_sample(f, along_x, k, across);
                deepest = terrimpi_max(deepest, deep);
                steepest[0] = terrimpi_max(steepest[0], deep / way);
                steepest[1] = terrimpi_max(steepest[1], deep / (1.0f - way));
            }
            for (k = 0; k < 4u; k++, xyz += 3) {
                const float *end = ends[k / 2u], *other = ends[1u - k / 2u];
                memcpy(xyz, end, sizeof ends[0]);
                for (c = 0; c < 3u && k % 2u != back && deepest > 0.0f; c++)
                    xyz[c] += (other[c] - end[c]) * deepest / steepest[k / 2u] -
                              (c == 1u ? deepest + terrimpi_mesh_under(t, 0) : 0.0f);
            }
            for (k = 0; k < 6u; k++)
                *indices++ = (uint16_t)(vertex + (0x230310u >> 4u * k & 3u));
        }
    }
}

/* Writes the floor and its walls. These stand on the outer border and face inwards, from below the
   floor up to the lowest samples between the points beside, so nowhere over the border. */
static void terrimpi_floor_write(const terrimp_terrain *t, float *xyz, uint16_t *indices)
{
    terrimpi_floor f = terrimpi_floor_of(t);
    uint32_t ground = f.ground_vertices, first = f.ground_indices, points = f.wall_points, i, k;
    terrimpi_floor_write_ground(t, xyz, indices);
    xyz += 3u * ground;
    for (k = 0; k < points; k++) {
        uint32_t at[2];
        float *top = xyz + 3u * (points + k);
        terrimpi_floor_wall_place(t, k, &at[0], &at[1]);
        xyz[3u * k] = top[0] = terrimpi_terrain_x(t, at[0]);
        xyz[3u * k + 1u] = terrimpi_mesh_of(t, t->tree.node_count - 1u)->low;
        xyz[3u * k + 2u] = top[2] = terrimpi_terrain_z(t, at[1]);
        top[1] = t->tree.pages ? t->tree.pages->lows[ground + k]
                               : terrimpi_min(terrimpi_floor_lowest(t, k + points - 1u),
                                              terrimpi_floor_lowest(t, k));
    }
    terrimpi_terrain_write_wall(indices + first, points, points, 1);
    for (i = first; i < f.skirt_index; i++)
        indices[i] = (uint16_t)(indices[i] + ground);
    terrimpi_skirts_write(t, xyz + 6u * points, indices + f.skirt_index, f.skirt_vertex);
}

/* Where a lower skirt ends that hangs from border vertex i: a quarter of the node's heights below
   it, D, or D = 2 e with the mesh's error e; at the node's lowest sample L when it or a vertex
   beside it would end below that. So the line of feet is below every sample, and no neighbour
   leaves a gap under it: ground is drawn through samples, and no mesh's border is below them
   (terrimpi_build_lift_border). Proof, for a sample s between two vertices: the border is at most
   s + e there. When one of them is within D of L, both end at L <= s; else each hangs by D or,
   since then L is deeper, by more, and the line is <= s + e - D <= s - e. And all of that ends a
   little lower: where ground is flat at L, a line of feet at L would be its border, but with other
   vertices, and where the two are rounded apart a pixel shows the sky.
   Down to the node's lowest point (Hess 4.2) much is drawn for nothing: a tenth of a frame of rough
   terrain, at the same PSNR. */
static float terrimpi_mesh_skirt_foot(const terrimp_terrain *t, uint32_t node, uint32_t level,
                                      const float *border, uint32_t i)
{
    const terrimp_geomip_node *range = terrimpi_tree_kept(&t->tree, node);
    uint32_t n = terrimpi_mesh_border(terrimpi_mesh_of(t, node));
    float height = border[i * 3u + 1u];
    float lowest = terrimpi_min(border[(i + 1u) % n * 3u + 1u],
                                border[(i + n - 1u) % n * 3u + 1u]);
    float depth = terrimpi_max(2.0f * terrimpi_mesh_of(t, node)->error,
                               0.25f * (range->high - range->low));
    float foot = terrimpi_min(lowest, height) - depth <= range->low
                     ? terrimpi_min(height, range->low) : height - depth;
    return foot - terrimpi_mesh_under(t, level);
}

/* Writes one node's vertices and indices with skirts, its whole share of the buffers. */
static void terrimpi_mesh_write(const terrimp_terrain *t, uint32_t node, float *xyz,
                                uint16_t *indices)
{
    terrimpi_terrain_tile p = terrimpi_terrain_tile_of(t, node);
    uint32_t border = terrimpi_mesh_border(terrimpi_mesh_of(t, node)), i;
    uint32_t vertices = terrimpi_mesh_vertices(terrimpi_mesh_of(t, node));
    uint32_t index_count = 3u * terrimpi_mesh_triangles(terrimpi_mesh_of(t, node));
    float *rim = xyz + (size_t)vertices * 3u;
    memset(xyz, 0, (size_t)t->vertex_stride * 3u * sizeof *xyz);
    memset(indices, 0, t->index_stride * sizeof *indices);
    for (i = 0; i < vertices; i++) {
        terrimpi_mesh_point_steps point = terrimpi_mesh_point(t, &p, node, i);
        xyz[i * 3u] = terrimpi_terrain_x(t, p.x + terrimpi_lattice(point.x, p.level, p.span_x));
        xyz[i * 3u + 1u] = point.height;
        xyz[i * 3u + 2u] = terrimpi_terrain_z(t,
                                              p.z + terrimpi_lattice(point.z, p.level, p.span_z));
    }
    for (i = 0; i < index_count; i++)
        indices[i] = (uint16_t)terrimpi_mesh_corner(t, node, i);
    if (t->desc.no_lower_skirts)
        return;
    memcpy(rim, xyz, (size_t)border * 3u * sizeof *rim);
    for (i = 0; i < border; i++)
        rim[i * 3u + 1u] = terrimpi_mesh_skirt_foot(t, node, p.level, xyz, i);
    terrimpi_terrain_write_wall(indices + index_count, border, vertices, 0);
}

TERRIMP_API terrimp_result terrimp_terrain_fill_mesh(const terrimp_terrain *terrain, uint32_t node,
                                                     float *xyz, size_t xyz_capacity,
                                                     uint16_t *indices, size_t index_capacity)
{
    uint32_t vertices, index_count;
    int is_floor;
    TERRIMPI_REFUSE(!terrain || !xyz || !indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    TERRIMPI_REFUSE(node > terrain->tree.node_count, TERRIMP_E_RANGE);
    is_floor = node == terrain->tree.node_count;
    TERRIMPI_REFUSE(!is_floor && !terrimpi_tree_opens(&terrain->tree, node), TERRIMP_E_PAGE);
    vertices = is_floor ? terrimpi_floor_of(terrain).vertices : terrain->vertex_stride;
    index_count = is_floor ? terrimpi_floor_of(terrain).indices : terrain->index_stride;
    TERRIMPI_REFUSE(xyz_capacity / 3u < vertices ||
                    index_capacity < index_count, TERRIMP_E_CAPACITY);
    if (is_floor)
        terrimpi_floor_write(terrain, xyz, indices);
    else
        terrimpi_mesh_write(terrain, node, xyz, indices);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_terrain_fill_meshes(const terrimp_terrain *terrain, float *xyz,
                                                       size_t xyz_capacity, uint16_t *indices,
                                                       size_t index_capacity)
{
    size_t node, vertex_stride, index_stride;
    TERRIMPI_REFUSE(!indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain || !xyz, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    TERRIMPI_REFUSE(terrain->tree.pages, TERRIMP_E_PAGE);
    vertex_stride = terrain->vertex_stride;
    index_stride = terrain->index_stride;
    node = terrain->tree.node_count;
    if (xyz_capacity / 3u < node * vertex_stride + terrimpi_floor_of(terrain).vertices ||
        index_capacity < node * index_stride + terrimpi_floor_of(terrain).indices)
        return TERRIMP_E_CAPACITY;
    terrimpi_floor_write(terrain, xyz + 3u * node * vertex_stride, indices + node * index_stride);
    while (node-- > 0)
        terrimpi_mesh_write(terrain, (uint32_t)node, xyz + 3u * node * vertex_stride,
                            indices + node * index_stride);
    return TERRIMP_OK;
}

#ifndef TERRIMP_NO_MALLOC

static void *terrimpi_terrain_default_allocate(void *user, size_t bytes)
{
    (void)user;
    return TERRIMP_MALLOC(bytes);
}

static void terrimpi_terrain_default_release(void *user, void *pointer, size_t bytes)
{
    (void)user;
    (void)bytes;
    TERRIMP_FREE(pointer);
}

/* The allocator to use; returns 0 when one of its functions is missing. */
static int terrimpi_terrain_allocator(const terrimp_allocator *wanted, terrimp_allocator *out)
{
    if (wanted) {
        *out = *wanted;
        return out->allocate && out->release;
    }
    out->user = NULL;
    out->allocate = terrimpi_terrain_default_allocate;
    out->release = terrimpi_terrain_default_release;
    return 1;
}

TERRIMP_API void terrimp_terrain_destroy(terrimp_terrain *terrain)
{
    if (terrain && terrain->allocator.release) {
        terrimp_allocator allocator = terrain->allocator;
        allocator.release(allocator.user, terrain, terrain->bytes);
    }
}

#endif /* TERRIMP_NO_MALLOC */

/* ==== Bake =============================================================== >>impl-bake */
/* A header, then the four arrays of the terrain's block as they are: nothing but 32-bit words.
   Where the arrays stand follows from the header's sizes: there is no offset to be false. */

#define TERRIMPI_BAKE_MAGIC 0x54494d50u
#define TERRIMPI_BAKE_MAGIC_SWAPPED 0x504d4954u /* as it reads in the other byte order */

enum {
    TERRIMPI_BAKE_NO_LOWER_SKIRTS = 1 << 0,
    TERRIMPI_BAKE_NOT_PROUD = 1 << 1
};

typedef struct terrimpi_bake {
    uint32_t magic, version;
    uint32_t bytes;         /* in all */
    uint32_t checksum;      /* of everything behind it */
    uint32_t width, depth;
    int32_t format;
    uint32_t chunk_quads, triangle_budget, flags;
    uint32_t node_count, vertex_limit, index_limit, mesh_triangle_count;
    uint32_t samples;       /* checksum of the heightfield's samples */
    float height_scale, height_offset;
    float height_low, height_high, sample_low, sample_high;
    float range_low, range_step, proud;
} terrimpi_bake;

/* What a header repeats of a terrain: X(its own field, that of the terrain). */
#define TERRIMPI_BAKE_FIELDS(X)                 \
    X(width, desc.field.width)                  \
    X(depth, desc.field.depth)                  \
    X(format, desc.field.format)                \
    X(chunk_quads, desc.chunk_quads)            \
    X(triangle_budget, desc.triangle_budget)    \
    X(node_count, tree.node_count)              \
    X(vertex_limit, vertex_limit)               \
    X(index_limit, index_limit)                 \
    X(mesh_triangle_count, mesh_triangle_count) \
    X(height_scale, desc.field.height_scale)    \
    X(height_offset, desc.field.height_offset)  \
    X(height_low, desc.height_low)              \
    X(height_high, desc.height_high)            \
    X(sample_low, sample_low)                   \
    X(sample_high, sample_high)                 \
    X(range_low, range_low)                     \
    X(range_step, range_step)                   \
    X(proud, desc.proud)

/* Fowler, Noll and Vo's hash, a word at a time: no changed word goes unseen, nor two that are
   exchanged. */
static uint32_t terrimpi_bake_hash_word(uint32_t hash, uint32_t word)
{
    return (hash ^ word) * 16777619u;
}

/* The hash of a block from its byte `from` on. Words are copied, since a float may not be looked at
   as an integer. */
static uint32_t terrimpi_bake_hash_from(const void *block, uint32_t from, uint32_t bytes)
{
    uint32_t hash = 2166136261u, word;
    for (; from + 4u <= bytes; from += 4u) {
        memcpy(&word, (const unsigned char *)block + from, sizeof word);
        hash = terrimpi_bake_hash_word(hash, word);
    }
    return hash;
}

/* The checksum of a bake. */
static uint32_t terrimpi_bake_hash(const void *block)
{
    uint32_t bytes;
    memcpy(&bytes, (const unsigned char *)block + offsetof(terrimpi_bake, bytes), sizeof bytes);
    return terrimpi_bake_hash_from(block, (uint32_t)offsetof(terrimpi_bake, width), bytes);
}

/* The checksum of a heightfield's samples, whatever their byte order and the length of rows. */
static uint32_t terrimpi_bake_hash_samples(const terrimp_heightfield *field)
{
    uint32_t hash = 2166136261u, x, z;
    for (z = 0; z < field->depth; z++)
        for (x = 0; x < field->width; x++)
            hash = terrimpi_bake_hash_word(hash,
                                           terrimpi_float_bits(terrimpi_field_raw(field, x,
                                                                                       z)));
    return hash;
}

/* ---- validation: nothing of a block is used before it has been looked at ---- */

/* Fills in a terrain from a header in this machine's byte order: all but the arrays and the field's
   samples. Returns 0 when the header is wrong. */
static int terrimpi_bake_header(const terrimpi_bake *bake, uint32_t version, terrimp_terrain *t)
{
    static const float any = 0.0f; /* stands for the samples: they are not looked at */
    memset(t, 0, sizeof *t);
    if (bake->version != version || bake->format == 0 || bake->chunk_quads == 0 ||
        bake->triangle_budget == 0 || bake->flags > 3u)
        return 0;
#define TERRIMPI_X(own, of) t->of = bake->own;
    TERRIMPI_BAKE_FIELDS(TERRIMPI_X)
#undef TERRIMPI_X
    t->desc.field.samples = &any;
    t->desc.not_proud = (bake->flags & TERRIMPI_BAKE_NOT_PROUD) != 0;
    t->desc.no_lower_skirts = (bake->flags & TERRIMPI_BAKE_NO_LOWER_SKIRTS) != 0;
    if (terrimp_terrain_desc_resolve(&t->desc, &t->desc) != TERRIMP_OK ||
        !terrimpi_terrain_count(t))
        return 0;
    return bake->node_count == t->tree.node_count && bake->vertex_limit == t->vertex_limit &&
           bake->index_limit == t->index_limit && terrimpi_finite2(t->sample_low, t->sample_high) &&
           terrimpi_terrain_range_fits(&t->desc.field, t->range_low, t->range_step);
}

/* Whether a header speaks of no more bytes than there are. */
static int terrimpi_bake_bytes_fit(const terrimpi_bake *bake, size_t bytes, terrimp_terrain *t)
{
    size_t arrays = terrimpi_terrain_layout(t, NULL);
    return arrays && bake->bytes >= sizeof *bake && bake->bytes <= bytes &&
           arrays == (size_t)bake->bytes - sizeof *bake;
}

/* Sets the arrays of a terrain to those of a bake. Only reading functions touch them then. */
static void terrimpi_bake_arrays_at(terrimp_terrain *t, const void *block)
{
    terrimpi_terrain_layout(t, (unsigned char *)(uintptr_t)block + sizeof(terrimpi_bake));
}

/* Whether the border runs once round the tile, counter-clockwise seen from above, from (0, 0). */
static int terrimpi_bake_loop_ok(const terrimp_terrain *t, const terrimpi_terrain_tile *tile,
                                 uint32_t node)
{
    uint32_t i, count = terrimpi_mesh_border(terrimpi_mesh_of(t, node));
    uint32_t last_x = tile->cols - 1u, last_z = tile->rows - 1u;
    terrimpi_mesh_point_steps p = terrimpi_mesh_point(t, tile, node, 0), q;
    if (p.x != 0 || p.z != 0)
        return 0;
    for (i = 0; i < count; i++, p = q) {
        int ok;
        q = terrimpi_mesh_point(t, tile, node, i + 1u < count ? i + 1u : 0);
        ok = (p.x == 0 && q.x == 0 && q.z > p.z) ||
             (p.z == last_z && q.z == last_z && q.x > p.x) ||
             (p.x == last_x && q.x == last_x && q.z < p.z) ||
             (p.z == 0 && q.z == 0 && q.x < p.x);
        if (!ok || (i > 0 && p.x == 0 && p.z == 0))
            return 0;
    }
    return 1;
}

/* A number for a directed edge that has nothing to do with those of others. */
static uint32_t terrimpi_bake_edge_hash(uint32_t from, uint32_t to)
{
    uint32_t hash = terrimpi_bake_hash_word(0, from << 8 | to);
    hash = terrimpi_bake_hash_word(hash >> 15, hash);
    return terrimpi_bake_hash_word(hash >> 13, hash);
}

/* What an edge adds to the sum over a surface; the same edge the other way takes it off. */
static TERRIMPI_CALL uint32_t terrimpi_bake_edge_sum(uint32_t from, uint32_t to)
{
    return terrimpi_bake_edge_hash(from, to) - terrimpi_bake_edge_hash(to, from);
}

/* Whether the triangles of a surface face up, have corners that exist, and cover its node: that
   inner edges have two sides, and border edges one, is told from a sum over all. */
static int terrimpi_bake_corners_ok(const terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                    uint32_t node)
{
    const terrimpi_mesh *mesh = terrimpi_mesh_of(t, node);
    int64_t all = 0;
    uint32_t i, k, edges = 0, border = terrimpi_mesh_border(mesh);
    for (i = 0; i < border; i++)
        edges -= terrimpi_bake_edge_sum(i, i + 1u < border ? i + 1u : 0u);
    for (i = 0; i < terrimpi_mesh_triangles(mesh); i++) {
        uint32_t corner[3];
        int64_t at[3][2], area;
        for (k = 0; k < 3u; k++) {
            terrimpi_mesh_point_steps point;
            corner[k] = terrimpi_mesh_corner(t, node, 3u * i + k);
            if (corner[k] >= terrimpi_mesh_vertices(mesh))
                return 0;
            point = terrimpi_mesh_point(t, p, node, corner[k]);
            at[k][0] = terrimpi_lattice(point.x, p->level, p->span_x);
            at[k][1] = terrimpi_lattice(point.z, p->level, p->span_z);
        }
        area = terrimpi_twice_area(at[0], at[1], at[2]);
        if (area <= 0)
            return 0;
        all += area;
        for (k = 0; k < 3u; k++)
            edges += terrimpi_bake_edge_sum(corner[k], corner[k == 2u ? 0 : k + 1u]);
    }
    return edges == 0 && all == 2 * (int64_t)p->span_x * (int64_t)p->span_z;
}

/* Whether heights and errors of a node could be those of one. */
static int terrimpi_bake_heights_ok(const terrimp_geomip_node *ground, const terrimpi_mesh *mesh)
{
    const float most = TERRIMPI_FLOAT_MAX;
    return terrimpi_within(ground->error, 0.0f, most) && terrimpi_within(ground->rms, 0.0f, most) &&
           terrimpi_within(mesh->error, 0.0f, most) &&
           terrimpi_within(mesh->error_rms, 0.0f, most) &&
           terrimpi_within(mesh->low, -most, most) &&
           terrimpi_within(mesh->high, mesh->low, most) &&
           terrimpi_within(ground->low, mesh->low, mesh->high) &&
           terrimpi_within(ground->high, ground->low, mesh->high);
}

/* Whether a node's are held by those of its parent. */
static int terrimpi_bake_heights_held(const terrimp_geomip_node *ground, const terrimpi_mesh *mesh,
                                      const terrimp_geomip_node *above,
                                      const terrimpi_mesh *mesh_above)
{
    return ground->low >= above->low && ground->high <= above->high &&
           ground->error <= above->error && mesh->low >= mesh_above->low &&
           mesh->high <= mesh_above->high;
}

/* Whether all numbers of one node are what building could have made. */
static int terrimpi_bake_node_ok(const terrimp_terrain *t, uint32_t node)
{
    const terrimpi_mesh *mesh = terrimpi_mesh_of(t, node);
    float slack = t->range_step + terrimpi_mesh_step(mesh); /* other machines round */
    uint32_t i, border = terrimpi_mesh_border(mesh), vertices = terrimpi_mesh_vertices(mesh);
    uint32_t triangles = terrimpi_mesh_triangles(mesh);
    terrimpi_terrain_tile p = terrimpi_terrain_tile_of(t, node);
    if (!terrimpi_bake_heights_ok(terrimpi_tree_kept(&t->tree, node), mesh) || border < 4u ||
        border > t->border_limit || vertices < border || vertices > t->vertex_limit ||
        triangles < 2u || triangles > t->desc.triangle_budget)
        return 0;
    for (i = 0; i < vertices; i++) {
        terrimpi_mesh_point_steps point = terrimpi_mesh_point(t, &p, node, i);
        if (point.x >= p.cols || point.z >= p.rows ||
            !(point.height + slack >= mesh->low && point.height - slack <= mesh->high))
            return 0;
    }
    return terrimpi_bake_loop_ok(t, &p, node) && terrimpi_bake_corners_ok(t, &p, node);
}

/* Checks a whole block and fills in a terrain from it. A resolved field has to be one that the bake
   could have been made of. */
static terrimp_result terrimpi_bake_read(const void *block, size_t bytes,
                                         const terrimp_heightfield *field, terrimp_terrain *t)
{
    const terrimp_heightfield *f = &t->desc.field;
    terrimpi_bake bake;
    uint32_t node, triangles = 0;
    TERRIMPI_REFUSE(!block, TERRIMP_E_NULL);
    TERRIMPI_REFUSE((uintptr_t)block % TERRIMPI_ALIGN != 0, TERRIMP_E_ALIGN);
    TERRIMPI_REFUSE(bytes < sizeof bake, TERRIMP_E_BAKE);
    memcpy(&bake, block, sizeof bake);
    TERRIMPI_REFUSE(bake.magic == TERRIMPI_BAKE_MAGIC_SWAPPED, TERRIMP_E_ORDER);
    TERRIMPI_REFUSE(bake.magic != TERRIMPI_BAKE_MAGIC ||
                    !terrimpi_bake_header(&bake, TERRIMP_BAKE_VERSION, t) ||
                    !terrimpi_bake_bytes_fit(&bake, bytes, t) ||
                    terrimpi_bake_hash(block) != bake.checksum, TERRIMP_E_BAKE);
    TERRIMPI_REFUSE(field && (field->width != f->width || field->depth != f->depth ||
                              field->format != f->format ||
                              field->height_scale != f->height_scale ||
                              field->height_offset != f->height_offset), TERRIMP_E_BAKE);
    terrimpi_bake_arrays_at(t, block);
    for (node = 0; node < t->tree.node_count; node++) {
        uint32_t above = node + 1u < t->tree.node_count
                             ? terrimpi_tree_parent_number(&t->tree, node) : node;
        if (!terrimpi_bake_node_ok(t, node) ||
            !terrimpi_bake_heights_held(&t->tree.nodes[node], &t->meshes[node],
                                        &t->tree.nodes[above], &t->meshes[above]))
            return TERRIMP_E_BAKE;
        triangles += terrimpi_mesh_triangles(terrimpi_mesh_of(t, node));
    }
    return triangles == t->mesh_triangle_count ? TERRIMP_OK : TERRIMP_E_BAKE;
}

TERRIMP_API terrimp_result terrimp_bake_check(const void *block, size_t bytes,
                                              const terrimp_heightfield *field,
                                              terrimp_bake_info *info)
{
    terrimp_terrain t;
    terrimp_heightfield resolved;
    terrimpi_bake bake;
    if (field)
        TERRIMPI_TRY(terrimp_heightfield_resolve(field, &resolved));
    TERRIMPI_TRY(terrimpi_bake_read(block, bytes, field ? &resolved : NULL, &t));
    memcpy(&bake, block, sizeof bake);
    TERRIMPI_REFUSE(field && terrimpi_bake_hash_samples(&resolved) != bake.samples, TERRIMP_E_BAKE);
    if (!info)
        return TERRIMP_OK;
    info->bytes = bake.bytes;
    info->width = bake.width;
    info->depth = bake.depth;
    info->format = bake.format;
    info->height_scale = t.desc.field.height_scale;
    info->height_offset = bake.height_offset;
    info->chunk_quads = bake.chunk_quads;
    info->triangle_budget = bake.triangle_budget;
    info->level_count = t.tree.level_count;
    info->node_count = bake.node_count;
    return TERRIMP_OK;
}

TERRIMP_API size_t terrimp_terrain_open_bytes(void)
{
    return sizeof(terrimp_terrain);
}

TERRIMP_API terrimp_result terrimp_terrain_open(const terrimp_heightfield *field,
                                                const void *block, size_t bytes, void *memory,
                                                size_t memory_bytes, terrimp_terrain **terrain)
{
    terrimp_terrain t;
    terrimp_heightfield resolved;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &resolved));
    TERRIMPI_TRY(terrimpi_check_block(memory, memory_bytes, sizeof t));
    TERRIMPI_TRY(terrimpi_bake_read(block, bytes, &resolved, &t));
    t.desc.field = t.tree.field = resolved;
    t.begun = t.built = t.baked = 1;
    *(terrimp_terrain *)memory = t;
    *terrain = (terrimp_terrain *)memory;
    return TERRIMP_OK;
}

/* ==== Visibility ========================================================= >>impl-visibility */
/* Based on: Lloyd and Egbert 2002, the horizon of a hierarchical terrain; the rest is our own.

   Sight lines are told by the axis that they follow most, so that their direction is t = -1..1, how
   far they go to the side with each quad that they go ahead, and distances count along that axis,
   in quads. Then a column x = i is crossed at one distance f by all sight lines of a quarter, and
   the slope (h - eye) / f of what stands there is linear in its height: over the directions of a
   bin [t1, t2] the ground is nowhere lower than the lowest of its heights at both ends and of the
   samples between them. So what a bin sees of a column is exact, and the horizon is raised by no
   more than is really there. Farther away the heights of 2^k samples of every 2^k-th column are
   kept by their minimum: the walls.

   A point is hidden when the slope of its sight line is below that of a wall before it: the line
   starts above the ground, is below it at the wall, and so has gone through it. What it went
   through is drawn, or is hidden itself by what it went through first. That takes three things: the
   eye is above the ground; nothing of this is clipped by z_near (walls within its reach do not
   count, and no line counts that is below the ground where it becomes visible); and walls hold for
   what is drawn. Drawn triangles of a coarser level run along the edges of finer ones, so above a
   quad they are between the lowest and the highest of its four samples, give or take their
   error. */

#define TERRIMPI_WALL_TOPS 4u      /* along a node's side: squares of which the height is kept */
#define TERRIMPI_WALL_FINE 20.0f   /* quads of distance for each quad between walls */
#define TERRIMPI_STAND_CLIPPED 16.0f /* [quads] that z_near may clip at most: else all is seen */
#define TERRIMPI_HORIZON_NONE -1e30f
#define TERRIMPI_HORIZON_ALL 1e30f
#define TERRIMPI_HORIZON_CLOSEST 0.25f /* [quads] of a wall: closer by, places are too rough */

/* ---- where an eye is ---- */

/* The last column, or row. */
static uint32_t terrimpi_stand_last(const terrimp_quadtree *tree, uint32_t axis)
{
    return (axis == 0 ? tree->field.width : tree->field.depth) - 1u;
}

/* A sample; HORIZON_ALL when its page is not here. */
static float terrimpi_stand_sample(const terrimp_quadtree *tree, uint32_t x, uint32_t z)
{
    return tree->pages ? tree->pages->calls->sample(tree, x, z)
                       : terrimpi_field_sample(&tree->field, x, z);
}

/* The highest that the ground can be within so many quads of the eye: of each quad the highest
   corner or, if that is less, how far its triangles rise there. */
static float terrimpi_stand_top(const terrimp_stand *s, const terrimp_quadtree *tree,
                                const float reach[2])
{
    uint32_t from[2], to[2], k, i, j;
    float top = TERRIMPI_HORIZON_NONE;
    for (k = 0; k < 2u; k++) {
        uint32_t last = terrimpi_stand_last(tree, k) - 1u;
        float wide = reach[k] + s->rounding, beyond = terrimpi_max(wide - s->within[k], 0.0f);
        if (wide > TERRIMPI_STAND_CLIPPED)
            return TERRIMPI_HORIZON_ALL;
        from[k] = s->quad[k] - terrimpi_min_u32(terrimpi_ceil_u32(beyond), s->quad[k]);
        to[k] = terrimpi_min_u32(s->quad[k] + (uint32_t)(s->within[k] + wide), last);
    }
    for (j = from[1]; j <= to[1]; j++)
        for (i = from[0]; i <= to[0]; i++) {
            float a = terrimpi_stand_sample(tree, i, j), u, v, low, high;
            float b = terrimpi_stand_sample(tree, i + 1u, j);
            float c = terrimpi_stand_sample(tree, i, j + 1u);
            float d = terrimpi_stand_sample(tree, i + 1u, j + 1u);
            u = (float)((int32_t)s->quad[0] - (int32_t)i) + s->within[0];
            v = (float)((int32_t)s->quad[1] - (int32_t)j) + s->within[1];
            low = a + (b - a) * u + (d - b) * v + terrimpi_abs(b - a) * reach[0] +
                  terrimpi_abs(d - b) * reach[1];
            high = a + (d - c) * u + (c - a) * v + terrimpi_abs(d - c) * reach[0] +
                   terrimpi_abs(c - a) * reach[1];
            high = terrimpi_min(terrimpi_max(low, high),
                                terrimpi_max(terrimpi_max(a, b), terrimpi_max(c, d)));
            top = terrimpi_max(top, high);
        }
    return top;
}

/* Finds which sight lines may begin below the ground, for what is closer than z_near is not drawn.
   Returns 0 when they all may. */
static int terrimpi_stand_clip(terrimp_stand *s, const terrimp_quadtree *tree,
                               const terrimp_capture *c)
{
    const terrimp_heightfield *field = &tree->field;
    float x = terrimpi_max(c->tan_right, -c->tan_left), y = terrimpi_max(c->tan_up, -c->tan_down);
    float reach = c->z_near * TERRIMP_SQRTF(1.0f + x * x + y * y), top = s->low, quads[2];
    s->clipped[0] = quads[0] = reach / field->spacing_x;
    s->clipped[1] = quads[1] = reach / field->spacing_z;
    s->steepest = TERRIMPI_HORIZON_NONE;
    if (terrimpi_tree_kept(tree, tree->node_count - 1u)->high < s->eye - 2.0f * reach)
        return 1;
    top += terrimpi_stand_top(s, tree, quads) + 2.0f * s->error * reach;
    if (top >= s->eye)
        return 0;
    if (top > s->eye - reach)
        s->steepest = (top - s->eye) * terrimpi_min(field->spacing_x, field->spacing_z) / reach;
    return 1;
}

/* By how many quads places may be off: two roundings of a float. */
static float terrimpi_stand_rounding(const terrimp_quadtree *tree)
{
    const terrimp_heightfield *f = &tree->field;
    float x = terrimpi_field_line(f->origin_x, f->spacing_x, f->width - 1u);
    float z = terrimpi_field_line(f->origin_z, f->spacing_z, f->depth - 1u);
    x = terrimpi_max(terrimpi_abs(f->origin_x), terrimpi_abs(x)) / f->spacing_x;
    z = terrimpi_max(terrimpi_abs(f->origin_z), terrimpi_abs(z)) / f->spacing_z;
    return 1e-6f + 1.2e-7f * terrimpi_max(x, z);
}

/* Finds the quad that the eye is above. Returns 0 when it is beside the terrain. */
static int terrimpi_stand_over(terrimp_stand *s, const terrimp_quadtree *tree, const float eye[3])
{
    const terrimp_heightfield *field = &tree->field;
    float x, z;
    if (!terrimpi_field_locate(field, eye[0], eye[2], &s->quad[0], &s->quad[1]))
        return 0;
    x = terrimpi_field_line(field->origin_x, field->spacing_x, s->quad[0]);
    z = terrimpi_field_line(field->origin_z, field->spacing_z, s->quad[1]);
    s->within[0] = terrimpi_clamp((eye[0] - x) / field->spacing_x, 0.0f, 1.0f);
    s->within[1] = terrimpi_clamp((eye[2] - z) / field->spacing_z, 0.0f, 1.0f);
    s->rounding = terrimpi_stand_rounding(tree);
    return 1;
}

/* The height of the ground below an eye; returns 0 when its page is not here. */
static int terrimpi_stand_ground(const terrimp_quadtree *tree, const float eye[3], float *ground)
{
    terrimp_heightfield field = tree->field;
    uint32_t level = 0;
    return (!tree->pages || tree->pages->calls->at(tree, eye[0], eye[2], &field, &level) ==
                                TERRIMP_OK) &&
           level == 0 && terrimp_heightfield_height(&field, eye[0], eye[2], ground) == TERRIMP_OK;
}

/* Looks at what a camera stands over. Returns 0 when nothing is hidden from it. */
static int terrimpi_stand_begin(terrimp_stand *s, const terrimp_quadtree *tree,
                                const terrimp_camera *camera, const terrimp_capture *capture,
                                float error, float low)
{
    const terrimp_geomip_node *all = terrimpi_tree_kept(tree, tree->node_count - 1u);
    float ground;
    s->eye = camera->eye[1];
    s->error = error;
    s->low = low + 4e-7f * (terrimpi_abs(s->eye) +
                            terrimpi_max(terrimpi_abs(all->low), terrimpi_abs(all->high)));
    return !camera->orthographic && !(camera->reach > 0.0f) &&
           terrimpi_stand_over(s, tree, camera->eye) &&
           terrimpi_stand_ground(tree, camera->eye, &ground) &&
           s->eye > ground + s->low && terrimpi_stand_clip(s, tree, capture);
}

/* Whether sight lines to a node whose lowest height is given could run below the ground where
   z_near lets them begin. */
static int terrimpi_stand_under(const terrimp_stand *s, float x, float z, float size, float low)
{
    float beside_x = terrimpi_max(terrimpi_max(x, -x - size), 0.0f);
    float beside_z = terrimpi_max(terrimpi_max(z, -z - size), 0.0f);
    return low - s->eye <= s->steepest * terrimpi_max(beside_x, beside_z);
}

/* ---- walls ---- */

/* How the walls of a node are kept: the height of code 0 and the step of the codes, as floats;
   [2 axes][cells lines][cells] codes of lowest heights, rounded down; and those of the highest of
   each of 4 x 4 squares, rounded up. */
static terrimp_walls terrimpi_walls_of(const terrimp_quadtree *tree, const void *codes)
{
    terrimp_walls w;
    w.tree = tree;
    w.codes = (const unsigned char *)codes;
    w.quads = tree->chunk_quads % 4u == 0 ? 4u : 2u;
    w.cells = tree->chunk_quads / w.quads;
    w.stride = 2u * (uint32_t)sizeof(float) + 2u * w.cells * w.cells +
               TERRIMPI_WALL_TOPS * TERRIMPI_WALL_TOPS;
    w.stride = (w.stride + 3u) / 4u * 4u;
    return w;
}

TERRIMP_API size_t terrimp_walls_bytes(const terrimp_quadtree *tree)
{
    size_t bytes;
    int ok = 1;
    if (!tree)
        return 0;
    bytes = terrimpi_mul(tree->node_count, terrimpi_walls_of(tree, NULL).stride, &ok);
    return ok ? bytes : 0;
}

static terrimp_result terrimpi_walls_check(const terrimp_quadtree *tree, const void *walls)
{
    TERRIMPI_REFUSE(!tree || !walls || !terrimpi_tree_is_built(tree), TERRIMP_E_NULL);
    TERRIMPI_REFUSE((uintptr_t)walls % sizeof(float) != 0, TERRIMP_E_ALIGN);
    return TERRIMP_OK;
}

/* The codes of a node's walls and the two floats before them. */
static const unsigned char *terrimpi_walls_codes(const terrimp_walls *w, uint32_t node,
                                                 float scale[2])
{
    const unsigned char *at = w->codes + (size_t)node * w->stride;
    memcpy(scale, at, 2u * sizeof(float));
    return at + 2u * sizeof(float);
}

/* Those of its squares. */
static const unsigned char *terrimpi_walls_tops(const terrimp_walls *w, uint32_t node,
                                                float scale[2])
{
    return terrimpi_walls_codes(w, node, scale) + 2u * w->cells * w->cells;
}

/* The lowest height of a wall of a level in the cells that quads i to j are in. The wall is told by
   the node across the axis that it is in, and its row there. */
static float terrimpi_walls_lowest(const terrimp_walls *w, uint32_t axis, uint32_t level,
                                   uint32_t across, uint32_t row, uint32_t i, uint32_t j)
{
    uint32_t shift = level + w->quads / 2u; /* quads are 2 or 4 */
    uint32_t cell = i >> shift, last = j >> shift, node = cell / w->cells;
    uint32_t columns = w->tree->level_x[level];
    float lowest = TERRIMPI_HORIZON_ALL, scale[2];
    row = (axis * w->cells + row) * w->cells;
    while (cell <= last) {
        uint32_t end = terrimpi_min_u32(last + 1u, (node + 1u) * w->cells), lowest_code = 255u;
        const unsigned char *codes = terrimpi_walls_codes(
            w, w->tree->level_first[level] + (axis == 0 ? node * columns + across
                                                        : across * columns + node), scale);
        for (; cell < end; cell++)
            lowest_code = terrimpi_min_u32(lowest_code, codes[row + cell - node * w->cells]);
        lowest = terrimpi_min(lowest, scale[0] + scale[1] * (float)lowest_code);
        node++;
    }
    return lowest;
}

/* ---- walls as an eye sees them ---- */

/* The sample where line `line` of an axis crosses line `other` of the other one: what is not here
   hides nothing. */
static float terrimpi_horizon_sample(const terrimp_horizon *h, uint32_t axis, uint32_t line,
                                     uint32_t other)
{
    float height = terrimpi_stand_sample(h->hider.tree, axis == 0 ? line : other,
                                         axis == 0 ? other : line);
    return height < TERRIMPI_HORIZON_ALL ? height : TERRIMPI_HORIZON_NONE;
}

/* The lowest height of a line of samples from place `from` to `to`, which are in quads i and j. */
static float terrimpi_horizon_ground(const terrimp_horizon *h, uint32_t axis, uint32_t line,
                                     uint32_t i, float from, uint32_t j, float to)
{
    float a = terrimpi_horizon_sample(h, axis, line, i);
    float b = terrimpi_horizon_sample(h, axis, line, i + 1u);
    float lowest = a + (b - a) * from;
    for (; i < j; i++) {
        lowest = terrimpi_min(lowest, b);
        a = b;
        b = terrimpi_horizon_sample(h, axis, line, i + 2u);
    }
    return terrimpi_min(lowest, a + (b - a) * to);
}

/* The least slope of what stands at a step, over the directions of a bin; NONE when a part of them
   has left the terrain. */
static float terrimpi_horizon_slope(const terrimp_horizon *h, uint32_t quarter, uint32_t bin,
                                    const terrimp_horizon_step *step)
{
    const float width = 2.0f / (float)TERRIMP_HORIZON_BINS;
    uint32_t axis = quarter / 2u, other = 1u - axis, i, j;
    uint32_t quads = terrimpi_stand_last(h->hider.tree, other);
    float t = (float)bin * width - 1.0f, lowest, slope;
    float from = h->stand.within[other] + t * step->distance - h->stand.rounding;
    float to = h->stand.within[other] + (t + width) * step->distance + h->stand.rounding;
    int32_t first = terrimpi_round_down(from), last = terrimpi_round_down(to);
    i = h->stand.quad[other] + (uint32_t)first; /* below 0 it becomes large */
    j = h->stand.quad[other] + (uint32_t)last;
    if (i >= quads || j >= quads)
        return TERRIMPI_HORIZON_NONE;
    lowest = step->level == 0 ? terrimpi_horizon_ground(h, axis, step->line, i, from - (float)first,
                                                        j, to - (float)last)
                              : terrimpi_walls_lowest(&h->walls, axis, step->level - 1u, step->node,
                                                      step->row, i, j);
    slope = (lowest - h->stand.low - h->stand.eye) * step->inverse;
    return slope - h->stand.error * (h->spread + terrimpi_abs(slope)) -
           h->stand.rounding * step->inverse * terrimpi_abs(slope);
}

/* Whether the horizon of a bin, made of what stands before a distance, is above what has a height
   ([wu] over the eye) at that distance or another one. It is looked for step by step and no farther
   than it takes. */
static int terrimpi_horizon_above(terrimp_horizon *h, uint32_t quarter, uint32_t bin,
                                  float distance, float height, float at)
{
    terrimp_horizon_bin *b = &h->bins[quarter][bin];
    uint32_t k;
    for (k = 0; k < TERRIMP_HORIZON_KEPT; k++) {
        uint32_t entry = (b->top - k) % TERRIMP_HORIZON_KEPT; /* a power of two */
        if (b->distance[entry] < distance) {
            if (b->slope[entry] * at > height)
                return 1;
            break;
        }
    }
    while (b->reached < h->step_count[quarter] &&
           h->steps[quarter][b->reached].distance < distance) {
        const terrimp_horizon_step *step = &h->steps[quarter][b->reached++];
        float slope = terrimpi_horizon_slope(h, quarter, bin, step);
        if (slope == TERRIMPI_HORIZON_NONE)
            b->reached = (uint16_t)h->step_count[quarter]; /* it does not come back */
        if (slope <= b->slope[b->top])
            continue;
        b->top = (uint16_t)((b->top + 1u) % TERRIMP_HORIZON_KEPT);
        b->slope[b->top] = slope;
        b->distance[b->top] = step->distance;
        if (slope * at > height)
            return 1;
    }
    return 0;
}

/* ---- what is below it ---- */

/* A box as a quarter sees it: [quads] ahead of the eye, [quads] to the side, [wu] above it. */
typedef struct terrimpi_horizon_box {
    float ahead[2], beside[2];
    float height;
} terrimpi_horizon_box;

/* The distances at which the directions of a bin may enter and leave a box. */
static void terrimpi_horizon_span(const terrimp_horizon *h, const terrimpi_horizon_box *box,
                                  uint32_t bin, float *enter, float *leave)
{
    const float *inverse = &h->inverse[bin];
    const int right = bin >= TERRIMP_HORIZON_BINS / 2; /* of the middle: t >= 0 */
    *enter = box->ahead[0];
    *leave = box->ahead[1];
    if (box->beside[0] > 0.0f)
        *enter = terrimpi_max(*enter, box->beside[0] * inverse[1]);
    if (box->beside[1] < 0.0f)
        *enter = terrimpi_max(*enter, box->beside[1] * inverse[0]);
    if (right && box->beside[1] > 0.0f)
        *leave = terrimpi_min(*leave, box->beside[1] * inverse[0]);
    if (!right && box->beside[0] < 0.0f)
        *leave = terrimpi_min(*leave, box->beside[0] * inverse[1]);
    *enter = terrimpi_max(*enter - 2.0f * h->stand.rounding, 0.0f);
    *leave = terrimpi_max(*leave + 2.0f * h->stand.rounding, *enter);
}

/* Whether the part of a box that one quarter sees is hidden. */
static int terrimpi_horizon_hides_quarter(terrimp_horizon *h, uint32_t quarter,
                                          const terrimpi_horizon_box *box)
{
    const float half = (float)TERRIMP_HORIZON_BINS * 0.5f;
    float a0 = box->ahead[0], a1 = box->ahead[1], o0 = box->beside[0], o1 = box->beside[1];
    float t0, t1, enter, leave, at;
    uint32_t bin, last;
    if (a1 <= 0.0f || o0 > a1 || o1 < -a1)
        return 1;
    t0 = o0 >= 0.0f ? o0 / a1 : a0 > 0.0f ? o0 / a0 : -1.0f;
    t1 = o1 <= 0.0f ? o1 / a1 : a0 > 0.0f ? o1 / a0 : 1.0f;
    if (t0 > 1.0f || t1 < -1.0f)
        return 1;
    bin = (uint32_t)terrimpi_clamp((t0 + 1.0f) * half - 0.01f, 0.0f, 2.0f * half - 1.0f);
    last = (uint32_t)terrimpi_clamp((t1 + 1.0f) * half + 0.01f, 0.0f, 2.0f * half - 1.0f);
    for (; bin <= last; bin++) {
        terrimpi_horizon_span(h, box, bin, &enter, &leave);
        at = box->height > 0.0f ? enter : leave; /* where its slope is largest */
        if (!(enter > 0.0f) || !terrimpi_horizon_above(h, quarter, bin, enter, box->height, at))
            return 0;
    }
    return 1;
}

/* Whether all four quarters hide a box: from corner (x, z), with sides of `size` [quads], up to a
   height [wu] over the eye. */
static int terrimpi_horizon_hides_box(terrimp_horizon *h, float x, float z, float size,
                                      float height)
{
    terrimpi_horizon_box box;
    float low[2], high[2];
    uint32_t quarter;
    low[0] = x;
    low[1] = z;
    high[0] = x + size;
    high[1] = z + size;
    box.height = height;
    if (low[0] <= 0.0f && high[0] >= 0.0f && low[1] <= 0.0f && high[1] >= 0.0f)
        return 0;
    for (quarter = 0; quarter < 4u; quarter++) {
        uint32_t axis = quarter / 2u, other = 1u - axis;
        int back = quarter & 1;
        box.ahead[0] = terrimpi_max(back ? -high[axis] : low[axis], 0.0f);
        box.ahead[1] = back ? -low[axis] : high[axis];
        box.beside[0] = low[other];
        box.beside[1] = high[other];
        if (!terrimpi_horizon_hides_quarter(h, quarter, &box))
            return 0;
    }
    return 1;
}

/* First the node as a whole; then, since its summit is seldom at its border, its squares, from the
   one that is closest to the eye. */
static int terrimpi_horizon_hides_node(terrimp_horizon *h, const terrimp_node *node, float raised)
{
    const terrimp_geomip_node *heights = terrimpi_tree_kept(h->hider.tree, node->number);
    uint32_t quads = h->hider.tree->chunk_quads << node->level, k, first;
    float size = (float)quads, part = size / (float)TERRIMPI_WALL_TOPS, scale[2];
    float x = (float)((int32_t)(node->x * quads) - (int32_t)h->stand.quad[0]) - h->stand.within[0];
    float z = (float)((int32_t)(node->z * quads) - (int32_t)h->stand.quad[1]) - h->stand.within[1];
    const unsigned char *tops;
    if (h->blind || !heights || terrimpi_stand_under(&h->stand, x, z, size, heights->low - raised))
        return 0;
    if (terrimpi_horizon_hides_box(h, x, z, size, heights->high - h->stand.eye))
        return 1;
    tops = terrimpi_walls_tops(&h->walls, node->number, scale);
    first = (x + 0.5f * size < 0.0f ? 3u : 0u) | (z + 0.5f * size < 0.0f ? 12u : 0u);
    for (k = 0; k < TERRIMPI_WALL_TOPS * TERRIMPI_WALL_TOPS; k++) {
        uint32_t i = k ^ first;
        float top = scale[0] + scale[1] * (float)tops[i] + raised + h->stand.low;
        if (!terrimpi_horizon_hides_box(h, x + part * (float)(i % TERRIMPI_WALL_TOPS),
                                        z + part * (float)(i / TERRIMPI_WALL_TOPS), part,
                                        terrimpi_min(top, heights->high) - h->stand.eye))
            return 0;
    }
    return 1;
}

TERRIMP_API int terrimp_horizon_hides(terrimp_horizon *horizon, uint32_t node, float raised)
{
    terrimp_node n;
    if (!horizon || !horizon->hider.tree || node >= horizon->hider.tree->node_count ||
        !(raised >= 0.0f))
        return 0;
    n = terrimpi_tree_node(horizon->hider.tree, node);
    return terrimpi_horizon_hides_node(horizon, &n, raised);
}

/* ---- the beginning of a frame ---- */

/* Lays out the steps of a quarter: every column at first, then every 2^k-th, as far apart as the
   distance allows. */
static void terrimpi_horizon_lay_steps(terrimp_horizon *h, uint32_t quarter)
{
    uint32_t axis = quarter / 2u, back = quarter & 1u, count = 0, apart = 1, level = 0;
    uint32_t end = terrimpi_stand_last(h->hider.tree, axis); /* behind the last is nothing */
    uint32_t line = h->stand.quad[axis] + (back ? 0u : 1u);
    while (line < end && count < TERRIMP_HORIZON_STEPS) {
        terrimp_horizon_step *step = &h->steps[quarter][count];
        float ahead = (float)(back ? h->stand.quad[axis] - line : line - h->stand.quad[axis]);
        step->distance = back ? ahead + h->stand.within[axis] : ahead - h->stand.within[axis];
        step->line = line;
        step->level = (uint8_t)level;
        if (level > 0) {
            uint32_t row = line / apart;
            step->node = (uint16_t)(row / h->walls.cells);
            step->row = (uint8_t)(row % h->walls.cells);
        }
        if (step->distance >= TERRIMPI_HORIZON_CLOSEST &&
            step->distance >= h->stand.clipped[axis]) {
            step->inverse = 1.0f / step->distance;
            count++;
        }
        while ((float)(2u * apart) * TERRIMPI_WALL_FINE <= step->distance &&
               line % (2u * apart) == 0 && level < h->hider.tree->level_count) {
            apart *= 2u;
            level += apart >= h->walls.quads ? 1u : 0u;
        }
        line = back ? line - apart : line + apart; /* from 0 it becomes large */
    }
    h->step_count[quarter] = count;
}

/* On which side of what the camera sees a direction is: bits for behind, left and right. */
static int terrimpi_horizon_beside(const float to[2], const float ahead[2], const float cone[2])
{
    float forward = to[0] * ahead[0] + to[1] * ahead[1];
    float side = to[1] * ahead[0] - to[0] * ahead[1];
    if (forward <= 0.0f)
        return 1;
    return (side < cone[0] * forward ? 2 : 0) | (side > cone[1] * forward ? 4 : 0);
}

/* Empties the bins of a quarter. Those that the camera does not see hide everything. */
static void terrimpi_horizon_empty(terrimp_horizon *h, uint32_t quarter, const float ahead[2],
                                   const float cone[2])
{
    uint32_t axis = quarter / 2u, bin, k, seen = 0;
    int before = 0, behind;
    for (bin = 0; bin <= TERRIMP_HORIZON_BINS; bin++, before = behind) {
        terrimp_horizon_bin *b = &h->bins[quarter][bin == 0 ? 0 : bin - 1u];
        float to[2];
        to[axis] = quarter & 1u ? -1.0f : 1.0f;
        to[1u - axis] = (float)bin * (2.0f / (float)TERRIMP_HORIZON_BINS) - 1.0f;
        behind = cone[0] < cone[1] ? terrimpi_horizon_beside(to, ahead, cone) : 0;
        if (bin == 0)
            continue;
        memset(b, 0, sizeof *b);
        for (k = 0; k < TERRIMP_HORIZON_KEPT; k++)
            b->slope[k] = (before & behind) ? TERRIMPI_HORIZON_ALL : TERRIMPI_HORIZON_NONE;
        seen |= !(before & behind);
    }
    h->step_count[quarter] = 0;
    if (seen)
        terrimpi_horizon_lay_steps(h, quarter);
}

/* The directions between which a camera sees ground, as tangents to the side of `ahead`; none
   (cone[0] = cone[1]) when it sees round about. */
static void terrimpi_horizon_cone(const terrimp_horizon *h, const terrimp_capture *c,
                                  float ahead[2], float cone[2])
{
    const terrimp_heightfield *field = &h->hider.tree->field;
    uint32_t i;
    ahead[0] = c->forward[0] / field->spacing_x;
    ahead[1] = c->forward[2] / field->spacing_z;
    cone[0] = 1e9f;
    cone[1] = -1e9f;
    for (i = 0; i < 4u; i++) {
        float x = i & 1u ? c->tan_right : c->tan_left, y = i & 2u ? c->tan_up : c->tan_down;
        float to_x = (c->forward[0] + x * c->right[0] + y * c->up[0]) / field->spacing_x;
        float to_z = (c->forward[2] + x * c->right[2] + y * c->up[2]) / field->spacing_z;
        float forward = to_x * ahead[0] + to_z * ahead[1];
        float side = to_z * ahead[0] - to_x * ahead[1];
        if (forward <= 1e-3f * terrimpi_abs(side) || !(forward > 0.0f)) {
            cone[0] = cone[1] = 0.0f;
            return;
        }
        cone[0] = terrimpi_min(cone[0], side / forward);
        cone[1] = terrimpi_max(cone[1], side / forward);
    }
    cone[0] -= 1e-4f * (1.0f + terrimpi_abs(cone[0]));
    cone[1] += 1e-4f * (1.0f + terrimpi_abs(cone[1]));
}

static void terrimpi_horizon_begin(terrimp_horizon *h, const terrimp_camera *camera, float error,
                                   float low)
{
    const terrimp_heightfield *field = &h->hider.tree->field;
    terrimp_capture capture;
    float ahead[2], cone[2];
    uint32_t i;
    h->spread = TERRIMP_SQRTF(field->spacing_x * field->spacing_x +
                              field->spacing_z * field->spacing_z);
    terrimpi_camera_capture(camera, &capture);
    h->blind = !terrimpi_stand_begin(&h->stand, h->hider.tree, camera, &capture, error, low);
    if (h->blind)
        return;
    for (i = 0; i <= TERRIMP_HORIZON_BINS; i++)
        h->inverse[i] = 1.0f / ((float)i * (2.0f / (float)TERRIMP_HORIZON_BINS) - 1.0f);
    terrimpi_horizon_cone(h, &capture, ahead, cone);
    for (i = 0; i < 4u; i++)
        terrimpi_horizon_empty(h, i, ahead, cone);
}

TERRIMP_API terrimp_result terrimp_horizon_begin(terrimp_horizon *horizon,
                                                 const terrimp_camera *camera, float error,
                                                 float low)
{
    terrimp_camera c;
    TERRIMPI_REFUSE(!horizon, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite2(error, low), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!terrimpi_within(error, 0.0f, 0.5f) || !(low >= 0.0f), TERRIMP_E_RANGE);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    terrimpi_horizon_begin(horizon, &c, error, low);
    return TERRIMP_OK;
}

/* What a view calls. */
static int terrimpi_horizon_hider_begin(terrimp_hider *hider, const terrimp_camera *camera,
                                        float error, float low)
{
    terrimp_horizon *h = (terrimp_horizon *)(void *)hider;
    terrimpi_horizon_begin(h, camera, error, low);
    return !h->blind;
}

static int terrimpi_horizon_hider_hides(terrimp_hider *hider, const terrimp_node *node)
{
    terrimp_horizon *h = (terrimp_horizon *)(void *)hider;
    return terrimpi_horizon_hides_node(h, node, h->stand.low);
}

TERRIMP_API terrimp_result terrimp_horizon_init(terrimp_horizon *horizon,
                                                const terrimp_quadtree *tree, const void *walls)
{
    TERRIMPI_REFUSE(!horizon, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_walls_check(tree, walls));
    memset(horizon, 0, sizeof *horizon);
    horizon->hider.tree = tree;
    horizon->hider.begin = terrimpi_horizon_hider_begin;
    horizon->hider.hides = terrimpi_horizon_hider_hides;
    horizon->walls = terrimpi_walls_of(tree, walls);
    horizon->blind = 1;
    return TERRIMP_OK;
}

/* ---- a selection without what is hidden ---- */

/* How far a node may be drawn off its samples: as it is, or as its parent when it morphs. At the
   far edges drawn triangles may cross those of the samples: there it can be anything between the
   heights of the node. */
static float terrimpi_horizon_node_error(const terrimp_quadtree *tree, const terrimp_node *n,
                                         int morphs)
{
    const terrimp_geomip_node *own = terrimpi_tree_kept(tree, n->number);
    uint32_t quads = tree->chunk_quads << n->level, part = (1u << n->level) - 1u;
    uint32_t last_x = tree->field.width - 1u, last_z = tree->field.depth - 1u;
    if (((n->x + 1u) * quads >= last_x && (last_x & part)) ||
        ((n->z + 1u) * quads >= last_z && (last_z & part)))
        return own->high - own->low;
    if (morphs && n->level + 1u < tree->level_count)
        return terrimpi_tree_kept(tree, terrimpi_tree_parent(tree, n).number)->error;
    return own->error;
}

/* The same for a draw, which at coarse borders is drawn as those beside it. */
static float terrimpi_horizon_draw_error(const terrimp_quadtree *tree,
                                         const terrimp_geomip_draw *draw, int morphs)
{
    terrimp_node n = draw->node, beyond;
    float error = terrimpi_horizon_node_error(tree, &n, morphs);
    int side;
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        if (!(draw->pattern >> side & 1u) || !terrimpi_tree_beyond(tree, &n, side, &beyond))
            continue;
        beyond = terrimpi_tree_parent(tree, &beyond);
        error = terrimpi_max(error, terrimpi_horizon_node_error(tree, &beyond, morphs));
    }
    return error;
}

/* Adds a node that may be drawn so far off to the two bounds that a horizon wants: close to the eye
   one of height, else one over distance. */
static void terrimpi_horizon_add_error(const terrimp_quadtree *tree, float off, float distance,
                                       float *error, float *low)
{
    if (distance < (float)tree->chunk_quads *
                       terrimpi_max(tree->field.spacing_x, tree->field.spacing_z))
        *low = terrimpi_max(*low, off);
    else
        *error = terrimpi_max(*error, off / distance);
}

TERRIMP_API terrimp_result terrimp_horizon_cull(terrimp_horizon *horizon,
                                                const terrimp_camera *camera,
                                                terrimp_geomip_view *view)
{
    const terrimp_quadtree *tree;
    terrimp_camera c;
    float error = 0.0f, low = 0.0f, off;
    uint32_t i, count = 0;
    TERRIMPI_REFUSE(!horizon || !view || !view->draws, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    tree = horizon->hider.tree;
    for (i = 0; i < view->draw_count; i++) {
        terrimp_box box;
        off = terrimpi_horizon_draw_error(tree, &view->draws[i], view->morph_ratio > 1.0f);
        terrimpi_mip_box(tree, &view->draws[i].node, &box);
        terrimpi_horizon_add_error(tree, off, terrimp_box_distance(&box, c.eye), &error, &low);
    }
    terrimpi_horizon_begin(horizon, &c, terrimpi_min(error, 0.5f), low);
    horizon->blind |= error > 0.5f;
    for (i = 0; i < view->draw_count; i++) {
        const terrimp_geomip_draw *draw = &view->draws[i];
        off = terrimpi_horizon_draw_error(tree, draw, view->morph_ratio > 1.0f);
        if (terrimpi_horizon_hides_node(horizon, &draw->node, off))
            view->triangle_count -= terrimpi_mip_triangles(tree->chunk_quads, draw->pattern);
        else
            view->draws[count++] = *draw;
    }
    view->draw_count = count;
    return TERRIMP_OK;
}

/* ---- visible sets ---- */

/* Heights over a cell's lowest ground have codes of 5 bits of a number and 3 of its exponent, up to
   TERRIMPI_SETS_UNITS. */
#define TERRIMPI_SETS_UNITS 4032.0f

static float terrimpi_sets_height(const terrimp_sets *s, float ground, uint32_t code)
{
    uint32_t units = code < 32u ? code : (32u + code % 32u) << (code / 32u - 1u);
    return ground + s->reach * (1.0f / TERRIMPI_SETS_UNITS) * (float)units;
}

/* The largest code of a height that is not above `y`. */
static uint32_t terrimpi_sets_code(const terrimp_sets *s, float ground, float y)
{
    uint32_t code = 0, bit;
    for (bit = 128u; bit > 0; bit >>= 1)
        if (terrimpi_sets_height(s, ground, code + bit) <= y)
            code += bit;
    return code;
}

static uint32_t terrimpi_sets_level_nodes(const terrimp_quadtree *tree, uint32_t level)
{
    return tree->level_first[level + 1u] - tree->level_first[level];
}

/* What ground and nodes may be off their samples, with the rounding of heights [wu]. */
static float terrimpi_sets_low(const terrimp_sets *s)
{
    const terrimp_geomip_node *all =
        terrimpi_tree_kept(s->hider.tree, s->hider.tree->node_count - 1u);
    float most = terrimpi_max(terrimpi_abs(all->low), terrimpi_abs(all->high));
    return s->low + 1e-6f * (2.0f * most + s->reach);
}

static int terrimpi_sets_begin(terrimp_hider *hider, const terrimp_camera *camera, float error,
                               float low)
{
    terrimp_sets *s = (terrimp_sets *)(void *)hider;
    const terrimp_quadtree *tree = hider->tree;
    uint32_t quads = tree->chunk_quads << s->cell_level;
    terrimp_capture capture;
    terrimp_node cell;
    terrimpi_camera_capture(camera, &capture);
    if (error > s->error || !terrimpi_stand_begin(&s->stand, tree, camera, &capture, error, low) ||
        s->stand.low > terrimpi_sets_low(s))
        return 0;
    cell = terrimpi_tree_at(tree, s->cell_level, s->stand.quad[0] / quads,
                            s->stand.quad[1] / quads);
    if (!terrimpi_tree_kept(tree, cell.number))
        return 0;
    s->row = s->codes + (size_t)(cell.number - tree->level_first[cell.level]) *
                            terrimpi_sets_level_nodes(tree, s->node_level);
    s->code = terrimpi_sets_code(s, terrimpi_tree_kept(tree, cell.number)->low, s->stand.eye);
    return 1;
}

/* A node is hidden when all those of the table's level in it are. */
static int terrimpi_sets_hides(terrimp_hider *hider, const terrimp_node *node)
{
    const terrimp_sets *s = (const terrimp_sets *)(void *)hider;
    const terrimp_quadtree *tree = hider->tree;
    uint32_t columns = tree->level_x[s->node_level], rows = tree->level_z[s->node_level];
    uint32_t quads = tree->chunk_quads << node->level, shift, x, z;
    if (node->level < s->node_level)
        return 0; /* then so was what it is in */
    shift = node->level - s->node_level;
    for (z = node->z << shift; z < (node->z + 1u) << shift && z < rows; z++)
        for (x = node->x << shift; x < (node->x + 1u) << shift && x < columns; x++)
            if (s->row[z * columns + x] <= s->code)
                return 0;
    return !terrimpi_stand_under(
        &s->stand, (float)((int32_t)(node->x * quads) - (int32_t)s->stand.quad[0]) -
                       s->stand.within[0],
        (float)((int32_t)(node->z * quads) - (int32_t)s->stand.quad[1]) - s->stand.within[1],
        (float)quads, terrimpi_tree_kept(tree, node->number)->low - s->stand.low);
}

TERRIMP_API size_t terrimp_sets_bytes(const terrimp_quadtree *tree, const terrimp_sets *sets)
{
    size_t bytes;
    int ok = 1;
    if (!tree || !sets || sets->cell_level >= tree->level_count ||
        sets->node_level >= tree->level_count)
        return 0;
    bytes = terrimpi_mul(terrimpi_sets_level_nodes(tree, sets->cell_level),
                         terrimpi_sets_level_nodes(tree, sets->node_level), &ok);
    return ok ? bytes : 0;
}

TERRIMP_API terrimp_result terrimp_sets_init(terrimp_sets *sets, const terrimp_quadtree *tree)
{
    const terrimp_geomip_node *all;
    TERRIMPI_REFUSE(!sets || !tree || !sets->codes || !terrimpi_tree_is_built(tree),
                    TERRIMP_E_NULL);
    all = terrimpi_tree_kept(tree, tree->node_count - 1u);
    TERRIMPI_REFUSE(!terrimpi_finite2(sets->error, sets->low) || !terrimpi_finite(sets->reach),
                    TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(terrimp_sets_bytes(tree, sets) == 0 || !(sets->low >= 0.0f) ||
                    !terrimpi_within(sets->error, 0.0f, 0.5f) || !(sets->reach >= 0.0f),
                    TERRIMP_E_RANGE);
    TERRIMPI_DEFAULT(sets->reach, 3.0f * (all->high - all->low));
    sets->hider.tree = tree;
    sets->hider.begin = terrimpi_sets_begin;
    sets->hider.hides = terrimpi_sets_hides;
    sets->hider.blind = 1;
    return TERRIMP_OK;
}

/* ==== Residency ========================================================== >>impl-residency */
/* Based on: de Boer 2000, section 3.2 (streaming); Hess 2010, section 6.6 (a picture needs its
   terrain only while it is made).

   The parent of a page that is here is here too (but for a while after an edit, when no frame comes
   to what lies below), so whatever is missing has a stand-in, and what is known of a node hangs on
   its parent's page alone. */

#define TERRIMPI_PAGE_WANTS 512u /* listed in a frame at most */
#define TERRIMPI_PAGE_SURE 4.0f  /* square of a guess of an error over its limit that is believed */
#define TERRIMPI_PAGES_MAGIC 0x54494d51u
#define TERRIMPI_PAGES_MAGIC_SWAPPED 0x514d4954u

/* What a page begins with; then come the records of the children, vertices and indices of the mesh
   and the samples. */
typedef struct terrimpi_page_head {
    uint32_t checksum; /* of all behind it */
    uint32_t stamp, node;
    terrimpi_record record;
} terrimpi_page_head;

/* What a file begins with; then come the heights of the floor. */
typedef struct terrimpi_pages_head {
    terrimpi_bake bake; /* of no arrays: bytes are those of the header */
    uint32_t block_level, stamp;
    float morph_ratio;
    terrimpi_record root;
} terrimpi_pages_head;

static uint32_t terrimpi_page_bytes(const terrimp_terrain *t)
{
    uint32_t side = t->desc.chunk_quads + 1u;
    uint32_t size = (uint32_t)terrimpi_field_sample_bytes(t->desc.field.format);
    uint32_t bytes = TERRIMPI_PAGE_CHILDREN + 4u * TERRIMPI_PAGE_RECORD + 4u * t->vertex_limit +
                     t->index_limit + size * side * side;
    return (bytes + 15u) / 16u * 16u;
}

/* The checksum of a page: of all but its first word. */
static uint32_t terrimpi_page_hash(const void *page, uint32_t bytes)
{
    return terrimpi_bake_hash_from(page, 4u, bytes);
}

/* ---- where pages stand: the levels above the blocks, row by row; then block by block, each from
   its top down, and on each level four children side by side ---- */

/* Nodes of so many levels of a full tree, from the root down. */
static uint32_t terrimpi_page_full(uint32_t levels) { return ((1u << 2u * levels) - 1u) / 3u; }

/* Interleaves the bits of a column and a row. */
static uint32_t terrimpi_page_interleave(uint32_t x, uint32_t z)
{
    uint32_t bit, out = 0;
    for (bit = 0; bit < 16u; bit++)
        out |= (x >> bit & 1u) << 2u * bit | (z >> bit & 1u) << (2u * bit + 1u);
    return out;
}

/* Where a block's pages begin, counted in pages: those above the blocks come first. */
static uint64_t terrimpi_page_first(const terrimp_quadtree *t, uint32_t block_level, uint32_t block)
{
    return t->node_count - t->level_first[block_level + 1u] +
           (uint64_t)block * terrimpi_page_full(block_level + 1u);
}

/* Where all pages end, counted the same way. */
static uint64_t terrimpi_page_end(const terrimp_quadtree *t, uint32_t level)
{
    return terrimpi_page_first(t, level, t->level_x[level] * t->level_z[level]);
}

static uint64_t terrimpi_page_offset(const terrimp_terrain *t, uint32_t block_level,
                                     const terrimp_node *n)
{
    const terrimp_quadtree *tree = &t->tree;
    uint64_t index = n->number - tree->level_first[block_level + 1u];
    if (n->level <= block_level) {
        uint32_t up = block_level - n->level, mask = (1u << up) - 1u;
        uint32_t block = (n->z >> up) * tree->level_x[block_level] + (n->x >> up);
        index = terrimpi_page_first(tree, block_level, block) + terrimpi_page_full(up) +
                terrimpi_page_interleave(n->x & mask, n->z & mask);
    }
    return TERRIMP_PAGES_HEADER_BYTES + index * terrimpi_page_bytes(t);
}

/* ---- the header ---- */

static int terrimpi_record_ok(const terrimpi_record *r)
{
    return terrimpi_bake_heights_ok(&r->ground, &r->mesh) &&
           terrimpi_within(r->held, r->ground.rms, TERRIMPI_FLOAT_MAX);
}

/* Reads a header into a terrain, all but its memory. */
static terrimp_result terrimpi_pages_read(const void *header, size_t bytes, terrimp_terrain *t,
                                          terrimpi_pages_head *head)
{
    const unsigned char *lows;
    uint32_t i;
    TERRIMPI_REFUSE(!header, TERRIMP_E_NULL);
    lows = (const unsigned char *)header + sizeof *head;
    TERRIMPI_REFUSE(bytes < TERRIMP_PAGES_HEADER_BYTES, TERRIMP_E_BAKE);
    memcpy(head, header, sizeof *head);
    TERRIMPI_REFUSE(head->bake.magic == TERRIMPI_PAGES_MAGIC_SWAPPED, TERRIMP_E_ORDER);
    TERRIMPI_REFUSE(head->bake.magic != TERRIMPI_PAGES_MAGIC ||
                    head->bake.bytes != TERRIMP_PAGES_HEADER_BYTES ||
                    terrimpi_bake_hash(header) != head->bake.checksum ||
                    !terrimpi_bake_header(&head->bake, TERRIMP_PAGES_VERSION, t) ||
                    head->block_level >= t->tree.level_count ||
                    !terrimpi_within(head->morph_ratio, 1.0f, 4.0f) ||
                    terrimpi_page_end(&t->tree, head->block_level) > 0xffffffffu ||
                    !terrimpi_record_ok(&head->root), TERRIMP_E_BAKE);
    for (i = 0; i < terrimpi_floor_of(t).ground_vertices + terrimpi_floor_of(t).wall_points; i++) {
        float height;
        memcpy(&height, lows + i * sizeof height, sizeof height);
        TERRIMPI_REFUSE(!terrimpi_finite(height), TERRIMP_E_BAKE);
    }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_check(const void *header, size_t bytes,
                                               terrimp_pages_info *info)
{
    terrimp_terrain t;
    terrimpi_pages_head head;
    TERRIMPI_TRY(terrimpi_pages_read(header, bytes, &t, &head));
    if (!info)
        return TERRIMP_OK;
    memset(info, 0, sizeof *info);
    info->page_bytes = terrimpi_page_bytes(&t);
    info->bytes = TERRIMP_PAGES_HEADER_BYTES +
                  terrimpi_page_end(&t.tree, head.block_level) * info->page_bytes;
    info->width = t.desc.field.width;
    info->depth = t.desc.field.depth;
    info->chunk_quads = t.desc.chunk_quads;
    info->level_count = t.tree.level_count;
    info->node_count = t.tree.node_count;
    info->block_level = head.block_level;
    info->stamp = head.stamp;
    info->height_scale = t.desc.field.height_scale;
    info->height_offset = t.desc.field.height_offset;
    info->morph_ratio = head.morph_ratio;
    return TERRIMP_OK;
}

/* ---- pages come and go ---- */

static terrimp_result terrimpi_page_check(const terrimp_terrain *t, uint32_t node, const void *out)
{
    TERRIMPI_REFUSE(!t || !out, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!t->tree.pages, TERRIMP_E_STATE);
    return node < t->tree.node_count ? TERRIMP_OK : TERRIMP_E_RANGE;
}

/* The slot of a node, NULL when it has none. */
static terrimpi_page_slot *terrimpi_page_slot_of(const struct terrimp_pages *p, uint32_t node)
{
    return p->slot_of[node] ? p->slots + p->slot_of[node] - 1u : NULL;
}

/* The slot of a node's parent; NULL for the root. */
static terrimpi_page_slot *terrimpi_page_above(const terrimp_quadtree *t, uint32_t node)
{
    return node + 1u < t->node_count
               ? terrimpi_page_slot_of(t->pages, terrimpi_tree_parent_number(t, node)) : NULL;
}

TERRIMP_API terrimp_result terrimp_page_get_info(const terrimp_terrain *terrain, uint32_t node,
                                                 terrimp_page_info *info)
{
    const terrimpi_page_slot *slot;
    terrimp_node n;
    TERRIMPI_TRY(terrimpi_page_check(terrain, node, info));
    slot = terrimpi_page_slot_of(terrain->tree.pages, node);
    n = terrimpi_tree_node(&terrain->tree, node);
    info->offset = terrimpi_page_offset(terrain, terrain->tree.pages->block_level, &n);
    info->bytes = terrain->tree.pages->page_bytes;
    info->level = n.level;
    info->state = !slot ? TERRIMP_PAGE_ABSENT : slot->page ? TERRIMP_PAGE_HERE
                                                              : TERRIMP_PAGE_COMING;
    info->slot = slot ? (uint32_t)(slot - terrain->tree.pages->slots) : 0u;
    return TERRIMP_OK;
}

/* Whether a slot may be given up: it has a page that this frame does not use, nor has the one
   before, and no page below it. The root stays. */
static int terrimpi_page_is_spare(const struct terrimp_pages *p, const terrimpi_page_slot *slot)
{
    return slot->page && slot->children == 0 && slot->used + 1u < p->frame &&
           slot->node + 1u < p->node_count;
}

static void terrimpi_page_clear(const terrimp_quadtree *t, terrimpi_page_slot *slot)
{
    terrimpi_page_slot *above = terrimpi_page_above(t, slot->node);
    if (above) {
        above->children--;
        above->lacking = (uint8_t)(above->lacking + (slot->page != NULL));
    }
    t->pages->slot_of[slot->node] = 0;
    slot->node = t->node_count;
    slot->page = NULL;
}

TERRIMP_API terrimp_result terrimp_page_begin(terrimp_terrain *terrain, uint32_t node, void **page)
{
    struct terrimp_pages *p;
    terrimpi_page_slot *above, *found = NULL, *slot;
    terrimp_node n, child;
    uint32_t i;
    TERRIMPI_TRY(terrimpi_page_check(terrain, node, page));
    p = terrain->tree.pages;
    above = terrimpi_page_above(&terrain->tree, node);
    TERRIMPI_REFUSE(p->slot_of[node] || (node + 1u < p->node_count && !above), TERRIMP_E_STATE);
    for (slot = p->slots; slot < p->slots + p->slot_count; slot++) {
        if (slot->node == p->node_count) {
            found = slot;
            break;
        }
        if (slot != above && terrimpi_page_is_spare(p, slot) &&
            (!found || slot->used < found->used))
            found = slot;
    }
    TERRIMPI_REFUSE(!found, TERRIMP_E_CAPACITY);
    if (found->node < p->node_count)
        terrimpi_page_clear(&terrain->tree, found);
    if (above)
        above->children++;
    found->node = node;
    found->used = p->frame;
    found->children = found->lacking = 0;
    n = terrimpi_tree_node(&terrain->tree, node);
    for (i = 0; i < 4u; i++)
        if (terrimpi_tree_quarter(&terrain->tree, &n, i, &child)) {
            found->lacking = (uint8_t)(found->lacking + !terrimpi_page_of(p, child.number));
            if (p->slot_of[child.number]) /* it failed or was edited, and they stay */
                found->children++;
        }
    p->slot_of[node] = (uint16_t)(found - p->slots + 1);
    *page = p->pages + (size_t)(found - p->slots) * p->page_bytes;
    return TERRIMP_OK;
}

/* The slot of a page that has been begun. */
static terrimp_result terrimpi_page_begun(const terrimp_terrain *t, uint32_t node,
                                          terrimpi_page_slot **slot)
{
    TERRIMPI_TRY(terrimpi_page_check(t, node, t));
    *slot = terrimpi_page_slot_of(t->tree.pages, node);
    return *slot && !(*slot)->page ? TERRIMP_OK : TERRIMP_E_STATE;
}

/* What a child asks of its parent's `held`: PICTURE counts rms times the length of a quad, and when
   nodes morph they measure at least morph_ratio^2 times what their children do. */
static float terrimpi_page_held_by(float morph_ratio, float held)
{
    return 0.5f * morph_ratio * morph_ratio * held;
}

/* Whether the records of a node's children are held by its own. Children that are here since before
   an edit have to be those that it knows. */
static int terrimpi_page_children_ok(const terrimp_terrain *t, const terrimp_node *n,
                                     const terrimpi_record *own)
{
    terrimpi_page_slot *slot;
    terrimp_node child;
    uint32_t i;
    for (i = 0; i < 4u; i++) {
        terrimpi_record r;
        if (!terrimpi_tree_quarter(&t->tree, n, i, &child))
            continue;
        memcpy(&r, terrimpi_page_of(t->tree.pages, n->number) + TERRIMPI_PAGE_CHILDREN +
                       i * TERRIMPI_PAGE_RECORD, sizeof r);
        if (!terrimpi_record_ok(&r) ||
            !terrimpi_bake_heights_held(&r.ground, &r.mesh, &own->ground, &own->mesh) ||
            terrimpi_page_held_by(t->tree.pages->morph_ratio, r.held) > own->held)
            return 0;
        slot = terrimpi_page_slot_of(t->tree.pages, child.number);
        if (slot && slot->page && memcmp(slot->record, &r, sizeof r) != 0)
            terrimpi_page_clear(&t->tree, slot);
    }
    return 1;
}

/* Whether a page that has just come is that of its node, which has a record above it, and all
   numbers of it are what building could have made. */
static int terrimpi_page_ok(const terrimp_terrain *t, uint32_t node, const unsigned char *record)
{
    const struct terrimp_pages *p = t->tree.pages;
    const unsigned char *page = terrimpi_page_of(p, node);
    terrimpi_page_head head;
    terrimpi_field_scan scan;
    terrimp_heightfield f = terrimpi_page_field(t, node);
    terrimp_node n = terrimpi_tree_node(&t->tree, node);
    memcpy(&head, page, sizeof head);
    if (head.checksum != terrimpi_page_hash(page, p->page_bytes) || head.stamp != p->stamp ||
        head.node != node ||
        memcmp(&head.record, record, sizeof head.record) != 0 ||
        !terrimpi_page_children_ok(t, &n, &head.record) || !terrimpi_bake_node_ok(t, node))
        return 0;
    scan.skip_voids = 0;
    return terrimpi_field_scan_tile(&f, 0, 0, f.width, f.depth, 1, &scan) == TERRIMP_OK &&
           terrimpi_field_world_height(&f, scan.low) >= head.record.ground.low &&
           terrimpi_field_world_height(&f, scan.high) <= head.record.ground.high;
}

TERRIMP_API terrimp_result terrimp_page_put(terrimp_terrain *terrain, uint32_t node)
{
    const terrimp_quadtree *t;
    terrimpi_page_slot *slot, *above;
    const unsigned char *record;
    float *mean;
    TERRIMPI_TRY(terrimpi_page_begun(terrain, node, &slot));
    t = &terrain->tree;
    record = terrimpi_tree_record(t, node);
    TERRIMPI_REFUSE(!record, TERRIMP_E_PAGE);
    above = terrimpi_page_above(t, node);
    if (above)
        above->lacking--;
    slot->page = t->pages->pages + (size_t)(slot - t->pages->slots) * t->pages->page_bytes;
    slot->used = t->pages->frame;
    memcpy(slot->record, record, sizeof slot->record);
    if (!terrimpi_page_ok(terrain, node, record)) {
        terrimpi_page_clear(t, slot);
        return TERRIMP_E_BAKE;
    }
    mean = &t->pages->held[terrimpi_tree_node(t, node).level];
    *mean += (terrimpi_page_held(t, node) - *mean) * (*mean > 0.0f ? 0.1f : 1.0f);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_page_fail(terrimp_terrain *terrain, uint32_t node)
{
    terrimpi_page_slot *slot;
    TERRIMPI_TRY(terrimpi_page_begun(terrain, node, &slot));
    terrimpi_page_clear(&terrain->tree, slot);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_next_frame(terrimp_terrain *terrain)
{
    TERRIMPI_TRY(terrimpi_page_check(terrain, 0, terrain));
    terrain->tree.pages->frame++;
    terrain->tree.pages->want_count = 0;
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_withdrawn(const terrimp_terrain *terrain, uint32_t *nodes,
                                                   uint32_t capacity, uint32_t *count)
{
    const struct terrimp_pages *p;
    uint32_t i;
    TERRIMPI_TRY(terrimpi_page_check(terrain, 0, count));
    TERRIMPI_REFUSE(!nodes && capacity > 0, TERRIMP_E_NULL);
    p = terrain->tree.pages;
    *count = 0;
    for (i = 0; i < p->slot_count; i++) {
        const terrimpi_page_slot *slot = &p->slots[i];
        if (slot->node == p->node_count || slot->page ||
            (slot->used + 1u >= p->frame && (slot->node + 1u == p->node_count ||
                                             terrimpi_page_above(&terrain->tree, slot->node))))
            continue;
        if (*count < capacity)
            nodes[*count] = slot->node;
        ++*count;
    }
    return TERRIMP_OK;
}

/* ---- what a frame uses ---- */

/* The record of a node whose page is not here: in its parent's. NULL when that is not here. */
static const unsigned char *terrimpi_page_record(const terrimp_quadtree *t, uint32_t number)
{
    terrimp_node n;
    const unsigned char *page;
    if (number + 1u == t->node_count)
        return t->pages->root;
    n = terrimpi_tree_node(t, number);
    page = terrimpi_page_of(t->pages, terrimpi_tree_parent(t, &n).number);
    return page ? page + TERRIMPI_PAGE_CHILDREN +
                      (n.x % 2u + n.z % 2u * 2u) * TERRIMPI_PAGE_RECORD : NULL;
}

/* Whether a want comes after another: the more urgent comes first, then the coarser, then the lower
   node. */
static int terrimpi_want_after(const void *wants, uint32_t a, uint32_t b)
{
    const terrimp_want *w = (const terrimp_want *)wants;
    if (w[a].urgency > w[b].urgency || w[a].urgency < w[b].urgency)
        return w[a].urgency < w[b].urgency;
    return w[a].level != w[b].level ? w[a].level < w[b].level : w[a].node > w[b].node;
}

/* Lists a page as wanted. Returns 0 when it is listed already, as urgent as this. */
static int terrimpi_page_list(struct terrimp_pages *p, const terrimp_node *node, int reason,
                              float urgency)
{
    uint32_t i, worst = 0, last = p->want_count;
    p->wants[last].node = node->number;
    p->wants[last].level = node->level;
    p->wants[last].bytes = p->page_bytes;
    p->wants[last].reason = reason;
    p->wants[last].urgency = urgency;
    for (i = 0; i < last && p->wants[i].node != node->number; i++) {}
    if (i < last) {
        if (!terrimpi_want_after(p->wants, i, last))
            return 0;
        p->wants[i] = p->wants[last];
    } else if (last < p->want_limit) {
        p->want_count++;
    } else {
        for (i = 0; i < last; i++)
            worst = terrimpi_want_after(p->wants, i, worst) ? i : worst;
        if (terrimpi_want_after(p->wants, worst, last))
            p->wants[worst] = p->wants[last];
    }
    return 1;
}

/* Notes that a page is of use in this frame. If it is missing, it is wanted at an urgency above 0,
   and those above it up to the one that is here. Returns whether it is here itself. */
static int terrimpi_page_want(const terrimp_quadtree *t, uint32_t node, int reason, float urgency)
{
    struct terrimp_pages *p = t->pages;
    uint32_t number = node;
    for (;;) {
        terrimpi_page_slot *slot = terrimpi_page_slot_of(p, number);
        terrimp_node n;
        if (slot)
            slot->used = p->frame; /* or it might be given up for this */
        if (slot && slot->page)
            return number == node;
        n = terrimpi_tree_node(t, number);
        if ((!slot && urgency > 0.0f && !terrimpi_page_list(p, &n, reason, urgency)) ||
            n.level + 1u == t->level_count)
            return 0;
        number = terrimpi_tree_parent(t, &n).number;
    }
}

/* Begins a view's update, which has no frame without the root's page. */
static void terrimpi_page_begin(const terrimp_quadtree *t)
{
    t->pages->want_first = t->pages->want_count;
    terrimpi_page_want(t, t->node_count - 1u, TERRIMP_WANT_GROUND, 1e6f);
}

/* The box of a node; of one that nothing is known of, its heights are those of the ground above. */
static void terrimpi_page_box(const terrimp_terrain *t, const terrimp_node *node, terrimp_box *box)
{
    terrimp_node known = *node;
    while (!terrimpi_tree_record(&t->tree, known.number))
        known = terrimpi_tree_parent(&t->tree, &known);
    terrimpi_terrain_mesh_box(t, node, terrimpi_mesh_of(t, known.number), box);
}

/* The same for a node and its children in sight, without which it may not be left for them. Returns
   whether all are here. Then the walk that finds what is in sight comes by and uses the children,
   unless `strays` says that it may not. Whether a child that is missing will have to be left, too,
   nobody knows; when it will if it is like others of its level (as the rule PICTURE measures, see
   terrimpi_mip_distance), all is asked for in one breath: so what a far jump needs comes at once,
   and not one level after the other. The last pages of two levels may be of different places, but
   children are seldom rougher than their parent: so a guess falls by half from level to level, or
   all that is in sight would be walked through: 12 s at 65537 x 65537. */
static int terrimpi_page_divides(const terrimp_terrain *t, const terrimp_node *node,
                                 const terrimpi_page_need *need)
{
    const struct terrimp_pages *p = t->tree.pages;
    terrimpi_page_slot *slot = terrimpi_page_slot_of(p, node->number);
    int all, uses = p->strays || need->reason != TERRIMP_WANT_GROUND;
    const float *held;
    float urgency;
    terrimpi_page_need below;
    terrimp_node child;
    terrimp_box box;
    uint32_t i;
    if (!uses && slot && slot->page && slot->lacking == 0) {
        slot->used = p->frame;
        return 1;
    }
    below = *need;
    urgency = TERRIMP_SQRTF(need->urgency);
    all = terrimpi_page_want(&t->tree, node->number, need->reason, urgency);
    for (i = 0; i < 4u && (all || need->urgency > 0.0f); i++) {
        if (!terrimpi_tree_quarter(&t->tree, node, i, &child) ||
            (!uses && terrimpi_page_of(p, child.number)))
            continue;
        terrimpi_page_box(t, &child, &box);
        if (terrimp_frustum_test(need->frustum, &box, TERRIMP_PLANES_ALL) ==
                TERRIMP_PLANES_OUTSIDE ||
            terrimpi_page_want(&t->tree, child.number, need->reason, urgency))
            continue;
        if (all && !uses) { /* it does not come to them: once more */
            uses = 1;
            i = 0xffffffffu;
        }
        all = 0;
        held = p->held + child.level;
        below.reach = need->reach *
                      (held[0] > 0.0f && held[1] > 0.0f
                           ? 0.5f * terrimpi_min(held[0] / held[1], 1.0f) : 0.25f);
        below.urgency = terrimpi_min(below.reach / terrimpi_mip_distance2(&box, need->eye),
                                     0.5f * need->urgency);
        if (child.level > 0 && below.urgency >= TERRIMPI_PAGE_SURE)
            terrimpi_page_divides(t, &child, &below);
    }
    return all;
}

/* Whether the nodes exist that have to beside and above one that is split. */
static int terrimpi_page_has_around(const terrimpi_mip_frame *mip, const terrimp_node *node)
{
    terrimp_node beyond;
    int side;
    if (node->level + 1u == mip->tree->level_count)
        return 1;
    if (terrimpi_mip_ratio_of(mip, terrimpi_tree_parent(mip->tree, node).number) < 1.0f)
        return 0;
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
        if (terrimpi_tree_beyond(mip->tree, node, side, &beyond) &&
            terrimpi_mip_ratio_of(mip, terrimpi_tree_parent(mip->tree, &beyond).number) < 1.0f)
            return 0;
    return 1;
}

/* Joins the nodes again that cannot be split, since pages are missing: from the root down, so that
   neighbours still differ by one level at most. All that the split would need is wanted; and the
   ground below the eye, which says whether it is over it. Returns how many are joined. What a try
   before this one wanted is of no use. */
static uint32_t terrimpi_page_settle(const terrimp_terrain *t, terrimpi_mip_frame *mip, int strays)
{
    terrimpi_page_need need = {&mip->frustum, mip->eye, TERRIMP_WANT_GROUND, 1.0f, 0.0f};
    uint32_t level, number, late = 0;
    terrimp_node below;
    t->tree.pages->want_count = t->tree.pages->want_first;
    t->tree.pages->strays = strays;
    if (mip->eye[1] < terrimpi_tree_kept(&t->tree, t->tree.node_count - 1u)->high &&
        terrimp_quadtree_find(&t->tree, 0, mip->eye[0], mip->eye[2], &below) == TERRIMP_OK)
        terrimpi_page_want(&t->tree, below.number, TERRIMP_WANT_GROUND, 1.0f);
    for (level = t->tree.level_count; level-- > 1u;)
        for (number = mip->first[level]; number != t->tree.node_count;
             number = mip->view->marks[number].next) {
            terrimp_geomip_mark *mark = &mip->view->marks[number];
            terrimp_node node = terrimpi_tree_node(&t->tree, number);
            if (mark->measure < 1.0f)
                continue;
            need.urgency = mark->measure;
            need.reach = !terrimpi_tree_record(&t->tree, number) /* its neighbour asks for it */
                             ? 0.0f : mip->relief * terrimpi_mip_distance(mip, level, number);
            if (terrimpi_page_divides(t, &node, &need) &&
                (late == 0 || terrimpi_page_has_around(mip, &node)))
                continue;
            mark->measure = -mark->measure;
            late++;
            t->tree.pages->strays = 1;
        }
    return late;
}

/* Asks for the pages that ground will need when the eye has gone on by `away`, so many times. */
static void terrimpi_page_look_ahead(const terrimp_terrain *t, const terrimpi_mip_frame *mip,
                                     const float away[3], float times)
{
    terrimpi_page_need need = {&mip->frustum, NULL, TERRIMP_WANT_AHEAD, 0.0f, 0.0f};
    float eye[3];
    uint32_t i;
    for (i = 0; i < 3u; i++)
        eye[i] = mip->eye[i] + away[i] * times;
    need.eye = eye;
    for (i = 0; i < mip->view->draw_count && terrimpi_length(away) > 0.0f; i++) {
        const terrimp_geomip_draw *draw = &mip->view->draws[i];
        float error = draw->error_px / mip->view->tolerance_px;
        terrimp_box box;
        if (draw->node.level == 0)
            continue;
        terrimpi_terrain_node_box(t, &draw->node, &box);
        need.urgency = 0.98f * terrimpi_min(error * error, 1.0f);
        if (error * error * terrimpi_mip_distance2(&box, mip->eye) >=
            terrimpi_mip_distance2(&box, eye))
            terrimpi_page_divides(t, &draw->node, &need);
    }
}

TERRIMP_API terrimp_result terrimp_pages_wants(terrimp_terrain *terrain, terrimp_want *wants,
                                               uint32_t capacity, uint32_t *count)
{
    struct terrimp_pages *p;
    uint32_t order[TERRIMPI_PAGE_WANTS], i, room = 0;
    TERRIMPI_TRY(terrimpi_page_check(terrain, 0, count));
    TERRIMPI_REFUSE(!wants && capacity > 0, TERRIMP_E_NULL);
    p = terrain->tree.pages;
    for (i = 0; i < p->want_count; i++)
        order[i] = i;
    terrimpi_sort(order, p->want_count, p->wants, terrimpi_want_after);
    for (i = 0; i < p->slot_count; i++)
        room += p->slots[i].node == p->node_count || terrimpi_page_is_spare(p, &p->slots[i]);
    room = terrimpi_min_u32(room, capacity);
    for (*count = i = 0; i < p->want_count && *count < room; i++)
        if (!p->slot_of[p->wants[order[i]].node]) /* it has not been begun since */
            wants[(*count)++] = p->wants[order[i]];
    return TERRIMP_OK;
}

/* The terrain that pages belong to: terrimp_pages_open puts them behind it. */
static const terrimp_terrain *terrimpi_page_terrain(const terrimp_quadtree *t)
{
    return (const terrimp_terrain *)(const void *)t->pages - 1;
}

/* The samples of a node whose page is here. */
static terrimpi_mip_ground terrimpi_page_ground(const terrimp_quadtree *t, const terrimp_node *node)
{
    terrimpi_mip_ground g;
    g.tree = t;
    g.field = terrimpi_page_field(terrimpi_page_terrain(t), node->number);
    g.level = node->level;
    g.quads = t->chunk_quads;
    g.i0 = node->x * g.quads;
    g.j0 = node->z * g.quads;
    return g;
}

/* The ground at a position: of the finest node whose page is here. */
static terrimp_result terrimpi_page_at(const terrimp_quadtree *t, float x, float z,
                                       terrimp_heightfield *ground, uint32_t *level)
{
    terrimp_node n;
    TERRIMPI_TRY(terrimp_quadtree_find(t, 0, x, z, &n));
    while (!terrimpi_page_of(t->pages, n.number)) {
        TERRIMPI_REFUSE(n.level + 1u == t->level_count, TERRIMP_E_PAGE);
        n = terrimpi_tree_parent(t, &n);
    }
    *ground = terrimpi_page_field(terrimpi_page_terrain(t), n.number);
    *level = n.level;
    return TERRIMP_OK;
}

/* A sample; HORIZON_ALL when its page is not here. */
static float terrimpi_page_sample(const terrimp_quadtree *t, uint32_t x, uint32_t z)
{
    uint32_t i = terrimpi_min_u32(x / t->chunk_quads, t->level_x[0] - 1u);
    uint32_t j = terrimpi_min_u32(z / t->chunk_quads, t->level_z[0] - 1u);
    terrimp_node n = terrimpi_tree_at(t, 0, i, j);
    terrimp_heightfield f;
    if (!terrimpi_page_of(t->pages, n.number))
        return TERRIMPI_HORIZON_ALL;
    f = terrimpi_page_field(terrimpi_page_terrain(t), n.number);
    return terrimpi_field_sample(&f, x - i * t->chunk_quads, z - j * t->chunk_quads);
}

/* ---- opening ---- */

/* The one description of the block: sets the arrays when there is a base. */
static size_t terrimpi_pages_layout(const terrimp_terrain *t, struct terrimp_pages *p,
                                    unsigned char *base, unsigned char **head)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    terrimpi_take(&b, 1, sizeof *t);
    terrimpi_take(&b, 1, sizeof *p);
    *head = (unsigned char *)terrimpi_take(&b, TERRIMP_PAGES_HEADER_BYTES, 1);
    p->slots = (terrimpi_page_slot *)terrimpi_take(&b, p->slot_count, sizeof *p->slots);
    p->slot_of = (uint16_t *)terrimpi_take(&b, t->tree.node_count, sizeof *p->slot_of);
    p->want_limit = terrimpi_min_u32(p->slot_count, TERRIMPI_PAGE_WANTS);
    p->wants = (terrimp_want *)terrimpi_take(&b, p->want_limit + 1u, sizeof *p->wants);
    p->pages = (unsigned char *)terrimpi_take(&b, p->slot_count, p->page_bytes);
    return b.ok ? b.bytes : 0;
}

TERRIMP_API size_t terrimp_pages_bytes(const void *header, size_t bytes, uint32_t slot_count)
{
    terrimp_terrain t;
    terrimpi_pages_head head;
    struct terrimp_pages p;
    unsigned char *none;
    if (!terrimpi_within_u32(slot_count, 8u, 65534u) ||
        terrimpi_pages_read(header, bytes, &t, &head) != TERRIMP_OK)
        return 0;
    p.slot_count = slot_count;
    p.page_bytes = terrimpi_page_bytes(&t);
    return terrimpi_pages_layout(&t, &p, NULL, &none);
}

TERRIMP_API terrimp_result terrimp_pages_open(const terrimp_heightfield *field, const void *header,
                                              size_t bytes, uint32_t slot_count, void *memory,
                                              size_t memory_bytes, terrimp_terrain **terrain)
{
    static const terrimpi_page_calls calls = {
        terrimpi_page_record, terrimpi_page_begin,      terrimpi_page_want,  terrimpi_page_divides,
        terrimpi_page_settle, terrimpi_page_look_ahead, terrimpi_page_ground, terrimpi_page_at,
        terrimpi_page_sample};
    terrimp_terrain t;
    terrimpi_pages_head head;
    struct terrimp_pages p;
    unsigned char *copy;
    uint32_t i;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_pages_read(header, bytes, &t, &head));
    TERRIMPI_REFUSE(!terrimpi_within_u32(slot_count, 8u, 65534u), TERRIMP_E_RANGE);
    memset(&p, 0, sizeof p);
    p.slot_count = slot_count;
    p.page_bytes = terrimpi_page_bytes(&t);
    p.node_count = t.tree.node_count;
    p.block_level = head.block_level;
    p.stamp = head.stamp;
    p.morph_ratio = head.morph_ratio;
    p.frame = 2;
    p.calls = &calls;
    TERRIMPI_TRY(terrimpi_check_block(memory, memory_bytes,
                                      terrimpi_pages_layout(&t, &p, NULL, &copy)));
    if (field) {
        terrimp_heightfield place = t.desc.field;
        place.samples = header;
        place.spacing_x = field->spacing_x, place.spacing_z = field->spacing_z;
        place.origin_x = field->origin_x, place.origin_z = field->origin_z;
        TERRIMPI_TRY(terrimp_heightfield_resolve(&place, &t.desc.field));
    }
    t.desc.field.samples = NULL; /* there are none but those of pages */
    t.desc.field.has_no_data = t.desc.field.wrap = 0;
    t.tree.field = t.desc.field;
    t.begun = t.built = t.baked = 1;
    terrimpi_pages_layout(&t, &p, (unsigned char *)memory, &copy);
    memset(memory, 0, (size_t)(p.pages - (unsigned char *)memory));
    memcpy(copy, header, TERRIMP_PAGES_HEADER_BYTES);
    p.header = copy;
    p.root = copy + offsetof(terrimpi_pages_head, root);
    p.lows = (const float *)(const void *)(copy + sizeof head);
    for (i = 0; i < slot_count; i++)
        p.slots[i].node = p.node_count;
    t.skirt_level = t.tree.level_count; /* none: their samples are not here */
    t.tree.pages = (struct terrimp_pages *)(void *)((terrimp_terrain *)memory + 1);
    *t.tree.pages = p;
    *(terrimp_terrain *)memory = t;
    *terrain = (terrimp_terrain *)memory;
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_renew(terrimp_terrain *terrain, const void *header,
                                               size_t bytes, const terrimp_rect *samples)
{
    const terrimp_rect all = {0, 0, 0xffffffffu, 0xffffffffu};
    terrimp_terrain t;
    terrimpi_pages_head head;
    struct terrimp_pages *p;
    uint32_t i;
    TERRIMPI_TRY(terrimpi_page_check(terrain, 0, header));
    samples = samples ? samples : &all;
    TERRIMPI_TRY(terrimpi_terrain_check_touched(terrain, samples));
    TERRIMPI_TRY(terrimpi_pages_read(header, bytes, &t, &head));
    p = terrain->tree.pages;
    TERRIMPI_REFUSE(head.stamp != p->stamp, TERRIMP_E_BAKE);
    for (i = 0; i < p->slot_count; i++)
        TERRIMPI_REFUSE(p->slots[i].node < p->node_count && !p->slots[i].page, TERRIMP_E_STATE);
    memcpy(p->header, header, TERRIMP_PAGES_HEADER_BYTES);
    terrain->sample_low = t.sample_low;
    terrain->sample_high = t.sample_high;
    for (i = 0; i < p->slot_count; i++)
        if (p->slots[i].page) {
            terrimp_node n = terrimpi_tree_node(&terrain->tree, p->slots[i].node);
            terrimpi_terrain_touched in = terrimpi_terrain_touched_nodes(terrain, samples, n.level,
                                                                         0);
            if (n.x >= in.x0 && n.x <= in.x1 && n.z >= in.z0 && n.z <= in.z1)
                terrimpi_page_clear(&terrain->tree, &p->slots[i]);
        }
    return TERRIMP_OK;
}

/* ---- heights and rays ---- */

/* The height of the finest ground that is here; *f is that, and *level its level. */
static terrimp_result terrimpi_terrain_ground(const terrimp_terrain *t, float x, float z,
                                              terrimp_heightfield *f, float *height,
                                              uint32_t *level)
{
    *level = 0;
    *f = t->desc.field;
    if (t->tree.pages)
        TERRIMPI_TRY(t->tree.pages->calls->at(&t->tree, x, z, f, level));
    return terrimp_heightfield_height(f, x, z, height);
}

TERRIMP_API terrimp_result terrimp_terrain_height(const terrimp_terrain *terrain, float x, float z,
                                                  float *height, float normal[3], uint32_t *level)
{
    terrimp_heightfield f;
    uint32_t found;
    float y;
    TERRIMPI_TRY(terrimpi_terrain_check_node(terrain, terrain ? terrain->tree.node_count - 1u : 0u,
                                             height));
    TERRIMPI_TRY(terrimpi_terrain_ground(terrain, x, z, &f, &y, &found));
    TERRIMPI_REFUSE(found > 0 && !level, TERRIMP_E_PAGE);
    *height = y;
    if (normal)
        TERRIMPI_TRY(terrimp_heightfield_normal(&f, x, z, normal));
    if (level)
        *level = found;
    return TERRIMP_OK;
}

/* Whether a ray comes into a box before a distance, or by. The direction's length is 1. */
static int terrimpi_page_on_way(const terrimp_box *box, const float origin[3],
                                const float direction[3], float distance)
{
    float from = 0.0f;
    int i;
    for (i = 0; i < 3; i++) {
        float slack = 1e-5f * (terrimpi_abs(box->min[i]) + terrimpi_abs(box->max[i]) +
                               terrimpi_abs(origin[i]));
        if (!terrimpi_field_ray_clip(origin[i], direction[i], box->min[i] - slack,
                                     box->max[i] + slack, &from, &distance))
            return 0;
    }
    return 1;
}

TERRIMP_API terrimp_result terrimp_terrain_raycast(const terrimp_terrain *terrain,
                                                   const float origin[3], const float direction[3],
                                                   float max_distance, terrimp_ray_hit *hit,
                                                   uint32_t *level)
{
    const terrimp_quadtree *tree;
    terrimp_ray_hit best, found;
    terrimpi_tree_walk walk;
    terrimpi_tree_visit v;
    float way[3], reach = max_distance;
    uint32_t coarsest = 0;
    int is_met = 0;
    TERRIMPI_REFUSE(!terrain || !origin || !direction, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    tree = &terrain->tree;
    if (!tree->pages) {
        if (level)
            *level = 0;
        return terrimp_heightfield_raycast(&terrain->desc.field, origin, direction, max_distance,
                                           hit);
    }
    TERRIMPI_REFUSE(!terrimpi_page_of(tree->pages, tree->node_count - 1u), TERRIMP_E_PAGE);
    TERRIMPI_REFUSE(!terrimpi_finite3(origin) || !terrimpi_finite3(direction) ||
                    !terrimpi_finite(max_distance), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(max_distance > 0.0f) || !terrimpi_field_ray_aim(direction, way),
                    TERRIMP_E_RANGE);
    memset(&best, 0, sizeof best);
    terrimpi_tree_begin(&walk, tree, origin, 0);
    while (terrimpi_tree_next(&walk, &v)) {
        terrimp_node children[4];
        terrimp_heightfield f;
        terrimp_box box;
        uint32_t i, count = 0;
        terrimpi_mip_box(tree, &v.node, &box);
        if (!terrimpi_page_of(tree->pages, v.node.number) ||
            !terrimpi_page_on_way(&box, origin, way, reach))
            continue;
        if (v.node.level > 0) /* those on the ray's way must all be here to answer for it */
            count = terrimpi_tree_children(tree, &v.node, origin, children);
        for (i = 0; i < count; i++) {
            terrimpi_mip_box(tree, &children[i], &box);
            if (!terrimpi_page_of(tree->pages, children[i].number) &&
                terrimpi_page_on_way(&box, origin, way, reach))
                break;
        }
        if (count > 0 && i == count) {
            terrimpi_tree_enter(&walk, &v);
            continue;
        }
        TERRIMPI_REFUSE(v.node.level > 0 && !level, TERRIMP_E_PAGE);
        coarsest = terrimpi_max_u32(coarsest, v.node.level);
        f = terrimpi_page_field(terrain, v.node.number);
        if (terrimp_heightfield_raycast(&f, origin, direction, max_distance, &found) !=
                TERRIMP_OK || (is_met && found.distance >= best.distance))
            continue;
        is_met = 1;
        best = found;
        reach = found.distance;
        best.x = (v.node.x * tree->chunk_quads + found.x) << v.node.level;
        best.z = (v.node.z * tree->chunk_quads + found.z) << v.node.level;
    }
    if (level)
        *level = coarsest;
    if (hit && is_met)
        *hit = best;
    return is_met ? TERRIMP_OK : TERRIMP_E_MISS;
}

/* ==== Capture ============================================================ >>impl-capture */
/* Based on: Hess 2010, sections 3.3, 3.4, 6.2 and 6.5.

   A picture to be made: its camera, the level of the ground that it shows, the width of the border
   around the node, and its layers. What is drawn for it is one list, back to front: a piece of the
   picture is a slice of that list, a layer draws what of it reaches into the layer's depths. */

#define TERRIMPI_CAPTURE_MARGIN 2u   /* texels around the fitted picture in its slot */
#define TERRIMPI_CAPTURE_SMALLEST 8u /* texels along a side */
#define TERRIMPI_CAPTURE_SOURCES 3u  /* a picture is made of up to 8 x 8 ground nodes */
#define TERRIMPI_CAPTURE_ROW 10u     /* ... and those beside them */
#define TERRIMPI_CAPTURE_DRAWS (TERRIMPI_CAPTURE_ROW * TERRIMPI_CAPTURE_ROW)
#define TERRIMPI_CAPTURE_SOURCE_TEXELS 0.5f /* rms error of that ground at most */
#define TERRIMPI_CAPTURE_OVERLAP 1.1f /* of a mesh's error along a ray: of layers, at their edge */
#define TERRIMPI_CAPTURE_LAYERS 2u   /* at most */

typedef struct terrimpi_capture_plan {
    terrimp_node node;
    terrimp_box box;
    float eye[3];           /* it is made from, or from far along it: see terrimpi_camera_stand */
    terrimp_capture camera; /* of all layers: they differ in their clip distances */
    float z_near[TERRIMPI_CAPTURE_LAYERS], z_far[TERRIMPI_CAPTURE_LAYERS];
    uint32_t layer_count;
    uint32_t source;        /* level of the ground that is drawn */
    uint32_t border;        /* its width: see terrimpi_terrain_apron_quads */
    const terrimp_cost_limit *limit; /* for pieces that end within a node; NULL: none does */
} terrimpi_capture_plan;

/* What only max_cost needs. */
struct terrimp_cost_limit {
    void (*draw_rows)(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                      const terrimp_node *node, uint32_t from, uint32_t to,
                      terrimp_ground_command *ground, const terrimp_callbacks *callbacks);
};

/* Ground of the source level: a whole node, or the part of one that lies in the border. */
typedef struct terrimpi_capture_draw {
    uint32_t node;
    uint32_t first_index, index_count, triangle_count;
} terrimpi_capture_draw;

/* ---- the camera ---- */

/* What the places of an orthographic picture of a node are relative to. */
static void terrimpi_capture_origin(const terrimp_terrain *t, const terrimp_node *node,
                                    float origin[3])
{
    terrimp_box box;
    float height = 0.5f * (t->desc.height_low + t->desc.height_high);
    terrimpi_tree_box(&t->tree, node, height, height, &box);
    memcpy(origin, box.min, sizeof box.min);
}

/* Fits the camera around a node's mesh, which is in xyz, and says how many texels the picture needs
   at so many for a unit of size at distance 1. It looks along forward, if that is not NULL. Returns
   0 when no camera fits. */
static int terrimpi_capture_aim(const terrimp_box *box, const float eye[3], const float *forward,
                                const float *xyz, uint32_t vertex_count, float density,
                                uint32_t largest, terrimp_capture *camera, uint32_t size[2])
{
    float width, height;
    if (terrimpi_camera_fit(box, eye, forward, camera) != TERRIMP_OK ||
        !terrimpi_camera_tighten(camera, xyz, vertex_count))
        return 0;
    width = (camera->tan_right - camera->tan_left) * density;
    height = (camera->tan_up - camera->tan_down) * density;
    if (!terrimpi_finite2(width, height)) /* the eye is almost beside a vertex */
        return 0;
    terrimpi_picture_size(width, height, TERRIMPI_CAPTURE_SMALLEST, largest, size);
    size[0] += 2u * TERRIMPI_CAPTURE_MARGIN;
    size[1] += 2u * TERRIMPI_CAPTURE_MARGIN;
    return 1;
}

/* The largest rms error of a node's ground when it is drawn with nodes of a finer level. Negative
   when a page is missing that would tell it. */
static float terrimpi_capture_source_error(const terrimp_quadtree *tree, const terrimp_node *node,
                                           uint32_t level)
{
    uint32_t shift = node->level - level, x, z;
    uint32_t x1 = terrimpi_min_u32((node->x + 1u) << shift, tree->level_x[level]);
    uint32_t z1 = terrimpi_min_u32((node->z + 1u) << shift, tree->level_z[level]);
    float worst = 0.0f;
    for (z = node->z << shift; z < z1; z++)
        for (x = node->x << shift; x < x1; x++) {
            const terrimp_geomip_node *kept = terrimpi_tree_kept(
                tree, tree->level_first[level] + z * tree->level_x[level] + x);
            if (!kept)
                return -1.0f;
            worst = terrimpi_max(worst, kept->rms);
        }
    return worst;
}

/* The level of the ground that a picture is made of: the coarsest whose rms error [wu] keeps to a
   limit; or that of which this is not known yet, when *is_known becomes 0: pages of that level are
   missing, and it needs them in any case. */
static uint32_t terrimpi_capture_source(const terrimp_quadtree *tree, const terrimp_node *node,
                                        float limit, int *is_known)
{
    uint32_t level = node->level;
    float error = 0.0f;
    while (level > 0 && node->level - level < TERRIMPI_CAPTURE_SOURCES) {
        error = terrimpi_capture_source_error(tree, node, level);
        if (!(error > limit))
            break;
        level--;
    }
    *is_known = error >= 0.0f;
    return level;
}

/* The sine of the angle at which a picture's camera looks down on its node, about. */
static float terrimpi_capture_sine(const terrimpi_capture_plan *plan)
{
    const terrimp_capture *c = &plan->camera;
    float drop = c->eye[1] - 0.5f * (plan->box.min[1] + plan->box.max[1]);
    return terrimpi_abs(c->orthographic ? c->forward[1] : drop / c->z_far);
}

/* The border of neighbours that a picture needs: so many texels, in world units. At a grazing angle
   a texel is as many times longer on the ground as the sine of that angle is smaller. */
static uint32_t terrimpi_capture_border(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                                        const uint32_t size[2], float texels)
{
    const terrimp_heightfield *field = &t->desc.field;
    const terrimp_capture *c = &plan->camera;
    uint32_t quads = t->desc.chunk_quads, width = 0, widths = terrimpi_terrain_apron_count(quads);
    float per_texel_x = (c->tan_right - c->tan_left) / (float)size[0];
    float per_texel_y = (c->tan_up - c->tan_down) / (float)size[1];
    float sine = terrimpi_max(terrimpi_capture_sine(plan), 0.1f);
    float reach = texels * (c->orthographic ? 1.0f : c->z_far) *
                  terrimpi_max(per_texel_x, per_texel_y / sine);
    float step = terrimpi_min(field->spacing_x, field->spacing_z) * (float)(1u << plan->source);
    while (width < widths && (float)terrimpi_terrain_apron_quads(quads, width) * step < reach)
        width++;
    return width;
}

/* Width of a plan's border in samples. */
static float terrimpi_capture_reach(const terrimp_terrain *t, const terrimpi_capture_plan *plan)
{
    return (float)(terrimpi_terrain_apron_quads(t->desc.chunk_quads, plan->border) << plan->source);
}

/* Spreads the camera over a slot of a size, and its depths over the border, which lies in front of
   and behind the box that was fitted. */
static void terrimpi_capture_spread(const terrimp_terrain *t, terrimpi_capture_plan *plan,
                                    const uint32_t size[2], float texels)
{
    terrimp_capture *c = &plan->camera;
    float border;
    terrimpi_impostor_pad(&c->tan_left, &c->tan_right, size[0] - 2u * TERRIMPI_CAPTURE_MARGIN,
                          TERRIMPI_CAPTURE_MARGIN);
    terrimpi_impostor_pad(&c->tan_down, &c->tan_up, size[1] - 2u * TERRIMPI_CAPTURE_MARGIN,
                          TERRIMPI_CAPTURE_MARGIN);
    plan->border = terrimpi_capture_border(t, plan, size, texels);
    border = 1.5f * terrimpi_capture_reach(t, plan) *
             terrimpi_max(t->desc.field.spacing_x, t->desc.field.spacing_z);
    c->z_near = c->orthographic ? c->z_near - border
                                : terrimpi_max(c->z_near * 0.5f, c->z_near - border);
    c->z_far += border;
    plan->z_near[0] = c->z_near;
    plan->z_far[0] = c->z_far;
}

/* ---- its layers ---- */

/* How far a picture's terrain may lie from the mesh that wears it, along a ray. */
static float terrimpi_capture_overlap(const terrimp_terrain *t, const terrimpi_capture_plan *plan)
{
    const terrimp_capture *c = &plan->camera;
    float drop = terrimpi_abs(c->eye[1] - 0.5f * (plan->box.min[1] + plan->box.max[1]));
    return terrimpi_min(TERRIMPI_CAPTURE_OVERLAP *
                            terrimpi_mesh_of(t, plan->node.number)->error * c->z_far /
                            terrimpi_max(drop, 1e-20f),
                        c->z_far);
}

/* Two layers, at a distance along forward. They overlap by what the mesh may be off. */
static void terrimpi_capture_divide(const terrimp_terrain *t, terrimpi_capture_plan *plan,
                                    float distance)
{
    float overlap = terrimpi_capture_overlap(t, plan);
    plan->z_near[1] = terrimpi_max(plan->z_near[0], distance - overlap);
    plan->z_far[1] = plan->z_far[0];
    plan->z_far[0] = terrimpi_min(plan->z_far[0], distance + overlap);
}

/* The camera of a layer: what of the mesh wears it. */
static terrimp_capture terrimpi_capture_layer(const terrimpi_capture_plan *plan, uint32_t layer)
{
    terrimp_capture camera = plan->camera;
    camera.z_near = plan->z_near[layer];
    camera.z_far = plan->z_far[layer];
    return camera;
}

/* Where the picture of a layer ends. That of the front one has all of the terrain, though only the
   front of the mesh wears it: a mesh that is proud of a ridge shows what lies behind it there, as
   in a picture of one layer, and not the sky. */
static float terrimpi_capture_end(const terrimpi_capture_plan *plan, uint32_t layer)
{
    return layer == 0 ? plan->camera.z_far : plan->z_far[layer];
}

/* Whether a ground node reaches into a layer. */
static int terrimpi_capture_in_layer(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                                     uint32_t node, uint32_t layer)
{
    terrimp_node place;
    terrimp_box box;
    float first, last;
    if (plan->layer_count == 1u)
        return 1;
    place = terrimpi_tree_node(&t->tree, node);
    terrimpi_terrain_node_box(t, &place, &box);
    terrimpi_camera_depths(&box, plan->camera.eye, plan->camera.forward, &first, &last);
    return first < terrimpi_capture_end(plan, layer) && last > plan->z_near[layer];
}

/* ---- its draws ---- */

/* One axis of the source nodes of a picture: the border's first one is 0. */
typedef struct terrimpi_capture_row {
    uint32_t first, count;                /* of the nodes without the border */
    uint8_t order[TERRIMPI_CAPTURE_ROW];  /* from the farthest to the closest */
} terrimpi_capture_row;

/* `at` is the node's place on its level, `nodes` how many nodes the source level has, and `eye` how
   many of those the eye is away from the terrain's edge. */
static void terrimpi_capture_order(uint32_t at, uint32_t shift, uint32_t nodes, float eye,
                                   terrimpi_capture_row *row)
{
    int low = 0, high, cell;
    uint32_t k;
    row->first = at << shift;
    row->count = terrimpi_min_u32(terrimpi_min_u32(1u << shift, nodes - row->first),
                                  TERRIMPI_CAPTURE_ROW - 2u);
    high = (int)row->count + 1;
    cell = (int)terrimpi_clamp(eye - (float)row->first + 1.0f, -1.0f, 99.0f);
    for (k = 0; k < terrimpi_min_u32(row->count + 2u, TERRIMPI_CAPTURE_ROW); k++)
        row->order[k] = (uint8_t)(cell - low > high - cell ? low++ : high--);
}

/* 0 and 2: in the border, before and behind the nodes of the picture. */
static uint32_t terrimpi_capture_side(const terrimpi_capture_row *row, uint32_t cell)
{
    return cell == 0 ? 0u : cell == row->count + 1u ? 2u : 1u;
}

/* Lists what a picture needs, back to front. Returns how many draws. */
static uint32_t terrimpi_capture_list(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                                      terrimpi_capture_draw draws[TERRIMPI_CAPTURE_DRAWS])
{
    const terrimp_heightfield *field = &t->tree.field;
    const float *eye = plan->eye;
    uint32_t quads = t->desc.chunk_quads, shift = plan->node.level - plan->source;
    uint32_t i, j, k, count = 0;
    float step = (float)(quads << plan->source);
    terrimpi_terrain_pattern patterns[9];
    terrimpi_capture_row across, along;
    terrimpi_capture_order(plan->node.x, shift, t->tree.level_x[plan->source],
                           (eye[0] - field->origin_x) / (step * field->spacing_x), &across);
    terrimpi_capture_order(plan->node.z, shift, t->tree.level_z[plan->source],
                           (eye[2] - field->origin_z) / (step * field->spacing_z), &along);
    for (k = 0; k < 9u; k++)
        patterns[k] = terrimpi_terrain_pattern_of(
            quads, k == 4u ? 0u :
                terrimpi_terrain_apron_pattern(quads, plan->border, k > 4u ? k - 1u : k));
    for (j = 0; j < along.count + 2u; j++)
        for (i = 0; i < across.count + 2u; i++) {
            uint32_t x = across.first + across.order[i] - 1u, z = along.first + along.order[j] - 1u;
            terrimpi_capture_draw *draw = &draws[count];
            if (!terrimpi_tree_has(&t->tree, plan->source, x, z))
                continue;
            k = terrimpi_capture_side(&along, along.order[j]) * 3u +
                terrimpi_capture_side(&across, across.order[i]);
            draw->node = terrimpi_tree_at(&t->tree, plan->source, x, z).number;
            draw->first_index = patterns[k].first_index;
            draw->index_count = patterns[k].index_count;
            draw->triangle_count = patterns[k].triangle_count;
            count++;
        }
    return count;
}

/* Triangles of a picture's draws, of all its layers. */
static uint32_t terrimpi_capture_triangles(const terrimp_terrain *t,
                                           const terrimpi_capture_plan *plan,
                                           const terrimpi_capture_draw *draws, uint32_t count)
{
    uint32_t i, layer, triangles = 0;
    for (i = 0; i < count; i++)
        for (layer = 0; layer < plan->layer_count; layer++)
            if (terrimpi_capture_in_layer(t, plan, draws[i].node, layer))
                triangles += draws[i].triangle_count;
    return triangles;
}

/* Rows of all columns of a node: a picture can be cut after each. */
static uint32_t terrimpi_capture_rows(const terrimp_terrain *t)
{
    return terrimpi_mip_columns(t->desc.chunk_quads) * t->desc.chunk_quads;
}

/* Draws some of the rows of a whole node: its columns come from both ends towards the eye's, and so
   do the rows of each. */
static void terrimpi_capture_draw_rows(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                                       const terrimp_node *node, uint32_t from, uint32_t to,
                                       terrimp_ground_command *ground,
                                       const terrimp_callbacks *callbacks)
{
    const terrimp_heightfield *f = &t->tree.field;
    uint32_t quads = t->desc.chunk_quads, columns = terrimpi_mip_columns(quads), k, half, before;
    float step = (float)(1u << node->level), side = (float)quads;
    float x = (plan->eye[0] - f->origin_x) / (f->spacing_x * step) - (float)node->x * side;
    float z = (plan->eye[2] - f->origin_z) / (f->spacing_z * step) - (float)node->z * side;
    uint32_t row = (uint32_t)terrimpi_clamp(z, 0.0f, side);
    for (before = 0; before < columns &&
                     (float)terrimpi_mip_column(quads, before + 1u) <= x; before++)
        ;
    for (k = from / quads; k * quads < to; k++) {
        uint32_t a = terrimpi_max_u32(from, k * quads) - k * quads;
        uint32_t b = terrimpi_min_u32(to - k * quads, quads);
        uint32_t column = k < before ? k : columns - 1u - (k - before);
        for (half = 0; half < 2u; half++) { /* rows before the eye's, then those behind it */
            uint32_t z0 = half ? row + quads - terrimpi_max_u32(b, row) : terrimpi_min_u32(a, row);
            uint32_t z1 = half ? row + quads - terrimpi_max_u32(a, row) : terrimpi_min_u32(b, row);
            terrimpi_terrain_pattern p = terrimpi_terrain_rows(quads, column, z0, z1);
            ground->first_index = p.first_index;
            ground->index_count = p.index_count;
            if (z0 < z1)
                callbacks->draw_ground(callbacks->user, ground);
        }
    }
}

TERRIMP_API const terrimp_cost_limit *terrimp_view_cost_limit(void)
{
    static const terrimp_cost_limit calls = {terrimpi_capture_draw_rows};
    return &calls;
}

/* Makes a slice of a layer, from the row `from` of all its draws on, up to `to`: the host's
   commands. `middle` is added to the places of all. */
static void terrimpi_capture_emit(const terrimp_terrain *t, const terrimpi_capture_plan *plan,
                                  const terrimpi_capture_draw *draws, uint32_t from, uint32_t to,
                                  uint32_t layer, const float middle[2],
                                  terrimp_capture_command *command, int depth_zero_to_one,
                                  const terrimp_callbacks *callbacks)
{
    const terrimp_heightfield *field = &t->desc.field;
    terrimp_capture camera = terrimpi_capture_layer(plan, layer);
    terrimp_ground_command ground;
    float border = terrimpi_capture_reach(t, plan);
    uint32_t rows = terrimpi_capture_rows(t), i;
    terrimp_node place;
    memset(&ground, 0, sizeof ground);
    place = terrimpi_real_place(t, &plan->node, middle, ground.offset);
    camera.z_far = terrimpi_capture_end(plan, layer);
    camera.eye[0] += middle[0];
    camera.eye[2] += middle[1];
    TERRIMPI_COMMAND_NODE(command, place);
    command->part = layer;
    terrimp_capture_matrices(&camera, depth_zero_to_one, command->view, command->projection);
    memcpy(command->eye, camera.eye, sizeof command->eye);
    command->clip_min[0] = plan->box.min[0] - border * field->spacing_x + middle[0];
    command->clip_min[1] = plan->box.min[2] - border * field->spacing_z + middle[1];
    command->clip_max[0] = plan->box.max[0] + border * field->spacing_x + middle[0];
    command->clip_max[1] = plan->box.max[2] + border * field->spacing_z + middle[1];
    callbacks->begin_capture(callbacks->user, command);
    for (i = from / rows; i * rows < to; i++) {
        terrimp_node node = terrimpi_tree_node(&t->tree, draws[i].node);
        uint32_t first = terrimpi_max_u32(from, i * rows) - i * rows;
        uint32_t last = terrimpi_min_u32(to - i * rows, rows);
        if (!terrimpi_capture_in_layer(t, plan, node.number, layer))
            continue;
        place = terrimpi_real_place(t, &node, middle, ground.offset);
        TERRIMPI_COMMAND_NODE(&ground, place);
        ground.first_index = draws[i].first_index;
        ground.index_count = draws[i].index_count;
        if (last - first < rows)
            plan->limit->draw_rows(t, plan, &node, first, last, &ground, callbacks);
        else
            callbacks->draw_ground(callbacks->user, &ground);
    }
    callbacks->end_capture(callbacks->user, command);
}

/* ==== View =============================================================== >>impl-view */
/* Based on: Hess 2010, chapters 3, 4 and 6; de Boer 2000, section 2.2; DESIGN of this header: one
   currency, pixels, and one cost model.

   A frame has two cuts through the quadtree. The ground cut is what terrimp_geomip_select draws (or
   all chunks in sight). The impostor cut is where nodes are small enough on the screen to be
   impostors. One walk lists the nodes in sight down to the deeper of the two, closest first; all
   else scans that list. Both cuts are nested in one tree, so it falls apart into regions: a region
   is the topmost node that is in either cut. It can be shown by its ground nodes or by its
   impostors: by whichever costs less. */

#define TERRIMPI_VIEW_AHEAD 0.6f      /* of its error's limit that a new picture starts with: it is
                                         made from ahead, so that this falls before it grows */
#define TERRIMPI_VIEW_AHEAD_BOX 0.8f  /* ... but not so far that a node is closer than this */
#define TERRIMPI_VIEW_EARLY 0.8f      /* error over limit from which a picture may be renewed */
#define TERRIMPI_VIEW_STALE 1.3f      /* ... from which it is not drawn: skylines of pictures that
                                         are older are torn */
#define TERRIMPI_VIEW_COARSE 1.3f     /* texels too large by this are due, */
#define TERRIMPI_VIEW_FINE 3.0f       /* ... and too small by this */
#define TERRIMPI_VIEW_FILL 0.7f       /* of the atlases, that pictures in use may fill, */
#define TERRIMPI_VIEW_SOFTEST 0.7f    /* ... with so much of texels_per_px at least */
#define TERRIMPI_VIEW_SKIRT_GAP 8u    /* segments out of sight that do not end a command: a third
                                         fewer than with 1, at 0.02 dB */
#define TERRIMPI_VIEW_BESIDE 0.1f     /* [rad] pictures that may turn by more than this have a floor
                                         below them from beside, too: with less no frame of 46,000
                                         had a hole that it would fill, and it takes 3 to 6 % */
#define TERRIMPI_VIEW_LIFE 600.0f     /* [frames] of a picture at most, for the cost model */
#define TERRIMPI_VIEW_FLIP 1.25f      /* how much cheaper another kind must be to be changed to */
#define TERRIMPI_VIEW_STAY 1.15f      /* how much closer an impostor comes before it is split */
#define TERRIMPI_VIEW_SEEN 0.4f       /* of the pixels of a picture, that the screen shows */
#define TERRIMPI_VIEW_BORDER 2.6f     /* triangles for a quad of a picture, border included */
#define TERRIMPI_VIEW_SHORT 30.0f     /* [frames] a picture that lasts for less has to be far
                                         cheaper than ground, if pages have to come for it */
#define TERRIMPI_VIEW_SPREAD 1.5f     /* captures of a frame over those of the mean frame */
#define TERRIMPI_VIEW_HYSTERESIS 0.1f /* of ground levels */
#define TERRIMPI_VIEW_COARSEST 1000.0f /* [px] ground tolerance when max_ground is short, */
#define TERRIMPI_VIEW_COARSER 1.3f    /* ... a step towards it */
#define TERRIMPI_VIEW_FINER 0.95f     /* ... and back, a frame; for max_cost, from which costs fall
                                         with the square of the tolerance, at least so much */
#define TERRIMPI_VIEW_FINEST 0.8f     /* ... and at most */
#define TERRIMPI_VIEW_DEARER 1.05f    /* a step of the tolerance when max_cost is short, */
#define TERRIMPI_VIEW_EVEN 4u         /* ... so many a frame; by it the next ones grow, each */
#define TERRIMPI_VIEW_RESERVE 0.25f   /* of it that is left for the captures of the mean frame */
#define TERRIMPI_VIEW_TRIES 12u       /* ... steps a frame at most: of 10 times the tolerance */
#define TERRIMPI_VIEW_SOON 90.0f      /* [frames] pages are asked for so long before their time */
#define TERRIMPI_VIEW_AGED 0.95f      /* of STALE: the most that light makes a picture urgent */
#define TERRIMPI_VIEW_LIGHT 0.0157f   /* [rad] tolerance of it, */
#define TERRIMPI_VIEW_LIGHT_FIRST 0.7f /* ... the share of it after which the first are due */
#define TERRIMPI_VIEW_JUMP 0.5f       /* of fade_start: a longer step of the eye is no motion */
#define TERRIMPI_VIEW_SPLIT_SMEAR 0.5f /* a picture has two layers when its smears over tolerance
                                         exceed this */
#define TERRIMPI_VIEW_SPLIT_GAIN 0.6f /* ... and fall to this at most */
#define TERRIMPI_VIEW_SPLIT_OVERLAP 0.6f /* ... unless these overlap in so much of their depth: then
                                         19 of 20 would spare too little (seven flights) */
#define TERRIMPI_CACHE_NO_PICTURE 0xffffu

/* How the eye moves: how far it is from where it was in the mean of the last 4, 16, 64 and 256
   frames. Who bobs is fast, but not far away from where he was: a picture that is good as far as
   that lasts. And how often all pictures are lost at once, by jumps or because the host says so. */
#define TERRIMPI_MOTION_COUNT 4u
typedef struct terrimpi_motion {
    float away[TERRIMPI_MOTION_COUNT][3]; /* [wu] */
    float frames[TERRIMPI_MOTION_COUNT];  /* which an eye of constant speed needs for that way */
    float since, between;            /* [frames] since the last loss, and between two in the mean */
} terrimpi_motion;

static void terrimpi_motion_begin(terrimpi_motion *m)
{
    memset(m, 0, sizeof *m);
    m->between = TERRIMPI_VIEW_LIFE;
}

/* Notes that all pictures are lost, or of no use. */
static void terrimpi_motion_lose(terrimpi_motion *m)
{
    m->between = 0.5f * (m->between + m->since);
    m->since = 0.0f;
}

/* A frame later; a jump is no motion. */
static void terrimpi_motion_step(terrimpi_motion *m, const float step[3], float jump)
{
    float way[3] = {0.0f, 0.0f, 0.0f}, frames = 4.0f;
    uint32_t k, i;
    m->since += 1.0f;
    if (terrimpi_length(step) > jump)
        terrimpi_motion_lose(m);
    else
        memcpy(way, step, sizeof way);
    for (k = 0; k < TERRIMPI_MOTION_COUNT; k++, frames *= 4.0f) {
        float keep = 1.0f - 1.0f / frames;
        for (i = 0; i < 3u; i++) {
            m->away[k][i] = keep * (m->away[k][i] + way[i]);
            if (terrimpi_abs(m->away[k][i]) < 1e-6f * jump) /* at rest, some time */
                m->away[k][i] = 0.0f;
        }
        m->frames[k] = keep * (m->frames[k] + 1.0f);
    }
}

/* The speed [wu a frame] with which an eye gets to `reach` away: the mean over about as many frames
   as it needs for that. */
static float terrimpi_motion_speed(const terrimpi_motion *m, float reach)
{
    float frames = 4.0f, speed = 0.0f;
    uint32_t k;
    for (k = 0; k < TERRIMPI_MOTION_COUNT; k++, frames *= 4.0f) {
        speed = terrimpi_length(m->away[k]) / terrimpi_max(m->frames[k], 0.75f);
        if (!(speed * frames < reach))
            break;
    }
    return speed;
}

/* What the whole of a frame looks at, and nothing changes. */
typedef struct terrimpi_frame {
    const terrimp_terrain *terrain;
    const terrimp_view_desc *desc; /* resolved */
    uint32_t number;               /* updates so far */
    float eye[3];                  /* that decisions are made from: see terrimpi_camera_stand */
    float pixel_factor;            /* K from there */
    float side_px;                 /* pixels of a unit of a fitted frustum's side: K, too, or */
    int still;                     /* the camera is that of the frame before */
    float middle[2];               /* [wu] the repetition of the eye, less the first one */
    float density;                 /* texels a pixel of what is captured */
    float light[3], light_tolerance; /* of length 1; a chord; 0: light is no matter */
    float light_step, light_speed; /* the same since the last frame; a frame, a running mean */
    terrimpi_motion motion;
    terrimp_camera camera;         /* resolved */
    terrimp_frustum frustum;
    terrimp_box all;               /* that is drawn of the terrain */
} terrimpi_frame;

/* From the closest of a frame's eyes to a box. */
static float terrimpi_view_distance(const terrimpi_frame *f, const terrimp_box *box)
{
    return terrimpi_max(0.0f, terrimp_box_distance(box, f->eye) - f->camera.reach);
}

/* ---- settings ---- */

/* Whether there are impostors: always from the fade band on, or in AUTO where they cost less. */
static int terrimpi_view_impostors(const terrimp_view_desc *d)
{
    return d->mode == TERRIMP_MODE_AUTO || d->mode == TERRIMP_MODE_IMPOSTOR;
}

/* Whether ground is drawn at its full resolution, else at a tolerance. */
static int terrimpi_view_full(const terrimp_view_desc *d)
{
    return d->mode == TERRIMP_MODE_FULL || d->mode == TERRIMP_MODE_IMPOSTOR;
}

/* One setting: fills in its default and checks it. *result says what is wrong with those so far:
   one that is not finite counts before one that is out of its limits. */
static void terrimpi_view_setting(float *value, float otherwise, float low, float high,
                                  terrimp_result *result)
{
    if (!terrimpi_finite(*value)) {
        *result = TERRIMP_E_NOT_FINITE;
        return;
    }
    if (*value == 0.0f)
        *value = otherwise;
    if (!terrimpi_within(*value, low, high) && *result == TERRIMP_OK)
        *result = TERRIMP_E_RANGE;
}

/* In AUTO one field, tolerance_px, rules the picture: a coarse one has pictures of fewer texels
   that live for longer and begin closer to the eye. (Measured on the rough terrain of 4097 samples:
   at 4 px 0.035 of the full mesh's time at 30 dB; before that 0.075 at 32 dB.) */
static terrimp_result terrimpi_view_settings(const terrimp_terrain *t, terrimp_view_desc *d)
{
    float coarse = 1.0f; /* the tolerance, where pictures follow it */
    const float most = TERRIMPI_FLOAT_MAX;
    float chunk = (float)t->desc.chunk_quads *
                  terrimpi_max(t->desc.field.spacing_x, t->desc.field.spacing_z);
    terrimp_result result = TERRIMP_OK;
    terrimpi_view_setting(&d->tolerance_px, 1.0f, 0.05f, 100.0f, &result);
    if (d->mode == TERRIMP_MODE_AUTO)
        coarse = terrimpi_clamp(d->tolerance_px, 1.0f, 9.0f);
    terrimpi_view_setting(&d->ground_tolerance_px, terrimpi_max(0.05f, 0.5f * d->tolerance_px),
                          0.05f, 100.0f, &result);
    terrimpi_view_setting(&d->morph_ratio, 1.0f, 1.0f, TERRIMPI_MIP_MORPH_MOST, &result);
    terrimpi_view_setting(&d->fade_start, terrimpi_max(1.0f, 2.0f / coarse) * chunk, 0.0f, most,
                          &result);
    terrimpi_view_setting(&d->fade_end,
                          (d->mode == TERRIMP_MODE_AUTO ? 1.1f : 1.5f) * d->fade_start, 0.0f, most,
                          &result);
    terrimpi_view_setting(&d->max_angle_rad, 0.0873f * TERRIMP_SQRTF(coarse), 0.001f, 1.5f,
                          &result);
    terrimpi_view_setting(&d->texels_per_px, 2.0f / TERRIMP_SQRTF(coarse), 0.1f, 8.0f, &result);
    terrimpi_view_setting(&d->impostor_px, 320.0f, 8.0f, 4096.0f, &result);
    terrimpi_view_setting(&d->max_cost, 0.0f, 0.0f, most, &result);
    terrimpi_view_setting(&d->costs.draw, 40.0f, 0.0f, most, &result);
    terrimpi_view_setting(&d->costs.triangle, 1.0f, 0.0f, most, &result);
    terrimpi_view_setting(&d->costs.ground_px, 0.25f, 0.0f, most, &result);
    terrimpi_view_setting(&d->costs.impostor_px, 0.25f, 0.0f, most, &result);
    terrimpi_view_setting(&d->costs.capture, 1400.0f, 0.0f, most, &result);
    return result;
}

TERRIMP_API terrimp_result terrimp_view_desc_resolve(const terrimp_terrain *terrain,
                                                     const terrimp_view_desc *desc,
                                                     terrimp_view_desc *out)
{
    terrimp_view_desc d;
    const terrimp_hider *hider;
    uint32_t chunks;
    TERRIMPI_REFUSE(!terrain || !desc || !out, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built, TERRIMP_E_STATE);
    d = *desc;
    if (d.mode == TERRIMP_MODE_DEFAULT)
        d.mode = TERRIMP_MODE_AUTO;
    TERRIMPI_TRY(terrimpi_view_settings(terrain, &d));
    if (d.ground_rule == TERRIMP_GEOMIP_DEFAULT)
        d.ground_rule = TERRIMP_GEOMIP_PICTURE;
    TERRIMPI_DEFAULT(d.atlas_size, 4096);
    TERRIMPI_DEFAULT(d.atlas_count, 1);
    TERRIMPI_DEFAULT(d.max_slot, d.atlas_size / 2u);
    TERRIMPI_DEFAULT(d.max_impostors, 1024);
    TERRIMPI_DEFAULT(d.max_captures, 64);
    TERRIMPI_DEFAULT(d.wrap_tiles, 3);
    TERRIMPI_REFUSE(terrain->desc.field.wrap && (!d.endless || !d.endless->fits(terrain, &d)),
                    TERRIMP_E_RANGE);
    chunks = terrain->tree.level_first[1];
    if (terrain->desc.field.wrap && !terrain->real)
        chunks *= d.wrap_tiles * d.wrap_tiles;
    TERRIMPI_DEFAULT(d.max_ground,
                     terrimpi_view_full(&d) ? chunks : terrimpi_min_u32(chunks, 4096));
    TERRIMPI_REFUSE(d.mode < 0 || d.mode >= (int)TERRIMP_MODE_COUNT || d.ground_rule < 0 ||
                    d.ground_rule >= (int)TERRIMP_GEOMIP_RULE_COUNT ||
                    (d.ground_rule == TERRIMP_GEOMIP_BOUND && !d.bound) ||
                    !(d.fade_end > d.fade_start) || d.atlas_size < 64u || d.atlas_size > 32768u ||
                    d.atlas_count > 16u || d.max_impostors > 65534u || d.max_captures > 1024u ||
                    d.joined > 15u || (d.max_cost > 0.0f && !d.cost_limit) ||
                    !terrimpi_within_u32(d.max_slot, 12u, d.atlas_size), TERRIMP_E_RANGE);
    for (hider = d.hider; hider; hider = hider->next)
        TERRIMPI_REFUSE(hider->tree != &terrain->tree || !hider->begin || !hider->hides,
                        TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(terrain->tree.pages && d.morph_ratio > 1.0f &&
                    (d.morph_ratio > terrain->tree.pages->morph_ratio ||
                     d.ground_rule != TERRIMP_GEOMIP_PICTURE), TERRIMP_E_RANGE);
    *out = d;
    return TERRIMP_OK;
}

#ifndef TERRIMP_NO_TROUBLE

TERRIMP_API const char *terrimp_view_desc_trouble(const terrimp_terrain *terrain,
                                                  const terrimp_view_desc *desc)
{
    static const terrimpi_trouble_field fields[] = {
        TERRIMPI_TROUBLE(terrimp_view_desc, mode),
        TERRIMPI_TROUBLE(terrimp_view_desc, tolerance_px),
        TERRIMPI_TROUBLE(terrimp_view_desc, ground_tolerance_px),
        TERRIMPI_TROUBLE(terrimp_view_desc, ground_rule),
        TERRIMPI_TROUBLE(terrimp_view_desc, morph_ratio),
        TERRIMPI_TROUBLE(terrimp_view_desc, fade_start),
        TERRIMPI_TROUBLE(terrimp_view_desc, fade_end),
        TERRIMPI_TROUBLE(terrimp_view_desc, max_angle_rad),
        TERRIMPI_TROUBLE(terrimp_view_desc, texels_per_px),
        TERRIMPI_TROUBLE(terrimp_view_desc, impostor_px),
        TERRIMPI_TROUBLE(terrimp_view_desc, atlas_size),
        TERRIMPI_TROUBLE(terrimp_view_desc, atlas_count),
        TERRIMPI_TROUBLE(terrimp_view_desc, max_slot),
        TERRIMPI_TROUBLE(terrimp_view_desc, max_impostors),
        TERRIMPI_TROUBLE(terrimp_view_desc, max_captures),
        TERRIMPI_TROUBLE(terrimp_view_desc, max_cost),
        TERRIMPI_TROUBLE(terrimp_view_desc, endless),
        TERRIMPI_TROUBLE(terrimp_view_desc, wrap_tiles),
        TERRIMPI_TROUBLE(terrimp_view_desc, hider),
        TERRIMPI_TROUBLE(terrimp_view_desc, joined),
        TERRIMPI_TROUBLE(terrimp_view_desc, costs)
    };
    terrimp_view_desc good, bad;
    if (!terrain || !desc)
        return "the descriptor";
    memset(&good, 0, sizeof good);
    good.endless = terrimp_view_endless();
    bad = *desc;
    TERRIMPI_FIND_TROUBLE(fields, good, bad, terrimp_view_desc_resolve(terrain, &bad, &bad));
}

#endif /* TERRIMP_NO_TROUBLE */

/* Place matrices: those of a picture, and the same relative to an eye. */
struct terrimp_exact_depth {
    void (*make)(const terrimp_capture *c, const terrimp_rect *slot, uint32_t atlas_width,
                 uint32_t atlas_height, float matrix[16]);
    void (*from)(float matrix[16], const float from[3], const float eye[3]);
};

TERRIMP_API const terrimp_exact_depth *terrimp_view_exact_depth(void)
{
    static const terrimp_exact_depth calls = {terrimpi_impostor_place_matrix,
                                              terrimpi_impostor_place_from};
    return &calls;
}

/* ---- the pictures: a cache ---- */

/* A slot of an atlas. */
typedef struct terrimpi_cache_slot_place {
    uint32_t atlas, slot;
} terrimpi_cache_slot_place;

/* The picture of a node. */
typedef struct terrimpi_cache_picture {
    terrimp_node node;
    uint8_t layer_count;      /* 0: not made yet */
    uint8_t layers_now;       /* when the impostors of the judged frame are drawn */
    uint8_t expired;          /* the host wants it renewed, */
    uint8_t lost;             /* ... or has said that it could not be made */
    uint32_t seen;            /* the last frame that had a use for it; 0: there is none */
    uint32_t listed;          /* the last frame that draws it, */
    uint32_t draw;            /* ... and its place on the list of that frame */
    uint32_t refused;         /* the last frame that found no room for it */
    uint32_t judged;          /* the last frame that `urgency` and what goes with it are of */
    uint32_t drawn_count;     /* frames that have drawn it since the capture */
    float eye[3];             /* of the capture's plan */
    float angle_rad, parallax_px, urgency;
    float sharpness;          /* texels per unit of size at distance 1 */
    float cost;               /* of the capture */
    float light[3];           /* in which it was made */
    terrimpi_cache_slot_place slots[TERRIMPI_CAPTURE_LAYERS];
    float texture_matrix[TERRIMPI_CAPTURE_LAYERS][16];
} terrimpi_cache_picture;

/* From the atlas to places relative to the eye of the capture, for exact depth. */
typedef struct terrimpi_cache_places {
    float matrix[TERRIMPI_CAPTURE_LAYERS][16];
} terrimpi_cache_places;

typedef struct terrimpi_cache {
    terrimp_live_atlas *atlases; /* [atlas_count] */
    terrimpi_cache_picture *pictures;  /* [capacity] */
    terrimpi_cache_places *places;     /* [capacity] NULL: not wanted; else made with `exact` */
    const terrimp_exact_depth *exact;
    uint16_t *of_node;           /* [node_count] */
    uint32_t atlas_count, capacity, node_count;
    uint32_t next;               /* where the search for a free picture goes on */
    uint32_t frame;              /* what is seen in it is not given up */
    uint32_t freed;              /* the last frame that gave room back */
    uint32_t failures, evictions; /* so far */
} terrimpi_cache;

static void terrimpi_cache_clear(terrimpi_cache *c)
{
    uint32_t i;
    memset(c->of_node, 0xff, c->node_count * sizeof *c->of_node);
    memset(c->pictures, 0, c->capacity * sizeof *c->pictures);
    for (i = 0; i < c->atlas_count; i++)
        terrimpi_atlas_reset(&c->atlases[i]);
}

/* The picture of a node, NULL when it has none. */
static terrimpi_cache_picture *terrimpi_cache_find(const terrimpi_cache *c, uint32_t node)
{
    uint16_t index = c->of_node[node];
    return index == TERRIMPI_CACHE_NO_PICTURE ? NULL : &c->pictures[index];
}

static void terrimpi_cache_free(terrimpi_cache *c, const terrimpi_cache_slot_place *slots,
                                uint32_t count)
{
    uint32_t i;
    if (count > 0)
        c->freed = c->frame;
    for (i = 0; i < count; i++)
        terrimp_live_atlas_free(&c->atlases[slots[i].atlas], slots[i].slot);
}

static void terrimpi_cache_drop(terrimpi_cache *c, terrimpi_cache_picture *picture)
{
    terrimpi_cache_free(c, picture->slots, picture->layer_count);
    c->of_node[picture->node.number] = TERRIMPI_CACHE_NO_PICTURE;
    memset(picture, 0, sizeof *picture);
}

/* Gives up the picture that was useful longest ago, if that was before this frame. */
static int terrimpi_cache_evict(terrimpi_cache *c)
{
    terrimpi_cache_picture *p, *oldest = NULL;
    for (p = c->pictures; p < c->pictures + c->capacity; p++)
        if (p->seen != 0 && p->seen != c->frame && (!oldest || p->seen < oldest->seen))
            oldest = p;
    if (!oldest)
        return 0;
    terrimpi_cache_drop(c, oldest);
    c->evictions++;
    return 1;
}

/* A picture for a node that has none; NULL when all are in use. */
static terrimpi_cache_picture *terrimpi_cache_take(terrimpi_cache *c, const terrimp_node *node)
{
    terrimpi_cache_picture *found = NULL;
    uint32_t i, turn;
    for (turn = 0; turn < 2u && !found; turn++) {
        for (i = 0; i < c->capacity && !found; i++) {
            if (c->pictures[c->next].seen == 0)
                found = &c->pictures[c->next];
            c->next = (c->next + 1u) % c->capacity;
        }
        if (!found && !terrimpi_cache_evict(c))
            return NULL;
    }
    found->node = *node;
    found->seen = c->frame;
    c->of_node[node->number] = (uint16_t)(found - c->pictures);
    return found;
}

static terrimp_rect terrimpi_cache_rect(const terrimpi_cache *c,
                                        const terrimpi_cache_slot_place *slot)
{
    return c->atlases[slot->atlas].slots[slot->slot];
}

/* Finds room for a picture, giving up the oldest ones that this frame does not draw. */
static int terrimpi_cache_slot(terrimpi_cache *c, const uint32_t size[2],
                               terrimpi_cache_slot_place *slot)
{
    do {
        for (slot->atlas = 0; slot->atlas < c->atlas_count; slot->atlas++)
            if (terrimp_live_atlas_alloc(&c->atlases[slot->atlas], size[0], size[1], &slot->slot) ==
                TERRIMP_OK)
                return 1;
    } while (terrimpi_cache_evict(c));
    c->failures++;
    return 0;
}

/* The same for each layer. */
static int terrimpi_cache_slots(terrimpi_cache *c, const uint32_t size[2],
                                terrimpi_cache_slot_place *slots, uint32_t count)
{
    uint32_t i, freed = c->freed;
    for (i = 0; i < count; i++)
        if (!terrimpi_cache_slot(c, size, &slots[i])) {
            terrimpi_cache_free(c, slots, i);
            c->freed = freed; /* there is no more room than before */
            return 0;
        }
    return 1;
}

/* Whether there is no room for a picture since there was none a frame before, and nothing has
   changed. */
static int terrimpi_cache_refuses(const terrimpi_cache *c, int still,
                                  terrimpi_cache_picture *picture)
{
    if (!still || picture->refused + 1u != c->frame || c->freed >= picture->refused)
        return 0;
    picture->refused = c->frame;
    return 1;
}

/* Whether the slots of a picture can take another of a size: not less than 90 % of it in either
   side, not more than half as much again. */
static int terrimpi_cache_suits(const terrimpi_cache *c, const terrimpi_cache_picture *picture,
                                const uint32_t size[2], uint32_t layer_count)
{
    uint32_t i;
    for (i = 0; i < layer_count && picture->layer_count == layer_count; i++) {
        terrimp_rect rect = terrimpi_cache_rect(c, &picture->slots[i]);
        if (rect.width * 10u < size[0] * 9u || rect.height * 10u < size[1] * 9u ||
            rect.width * 2u > size[0] * 3u || rect.height * 2u > size[1] * 3u)
            return 0;
    }
    return picture->layer_count == layer_count;
}

/* Whether a picture shows a rectangle of samples: its border is at most the node's neighbours. */
static int terrimpi_cache_shows(const terrimpi_cache_picture *picture, uint32_t chunk_quads,
                                uint32_t x, uint32_t z, uint32_t cols, uint32_t rows)
{
    uint32_t quads = chunk_quads << picture->node.level;
    const terrimp_node *n = &picture->node;
    return picture->seen != 0 && x <= (n->x + 2u) * quads && x + cols + quads > n->x * quads &&
           z <= (n->z + 2u) * quads && z + rows + quads > n->z * quads;
}

/* ---- what is in sight ---- */

/* The error that a node's coarse mesh counts with: the largest one for a bound, else twice the root
   of the mean square, which 95 of 100 samples keep to. */
static float terrimpi_view_mesh_error(const terrimpi_frame *f, uint32_t node)
{
    const terrimpi_mesh *mesh = terrimpi_mesh_of(f->terrain, node);
    return f->desc->ground_rule == TERRIMP_GEOMIP_PICTURE
               ? terrimpi_min(mesh->error, 2.0f * mesh->error_rms)
               : mesh->error;
}

/* The sine of the view angle up to which a picture may be used, by both limits. */
static float terrimpi_view_sine(const terrimpi_frame *f, uint32_t node, float closest)
{
    float sine = TERRIMP_SINF(f->desc->max_angle_rad), error = terrimpi_view_mesh_error(f, node);
    sine = terrimpi_min(sine, f->desc->tolerance_px * terrimpi_max(closest - error, 0.0f) /
                                  terrimpi_max(error * f->pixel_factor, 1e-20f));
    return f->camera.reach > 0.0f ? terrimpi_max(sine - f->camera.reach / closest, 0.0f) : sine;
}

/* How far a picture and what is drawn beside it may be apart [px] until the picture is gone: by its
   parallax error, which is less than the tolerance where the angle is at its limit before that; or
   by what ground beside it is off, of a level up to two coarser: borders are lifted over that. */
static float terrimpi_view_apart(const terrimpi_frame *f, const terrimp_node *node, float closest)
{
    const terrimp_quadtree *tree = &f->terrain->tree;
    const terrimp_geomip_node *beside;
    float error = terrimpi_view_mesh_error(f, node->number), off = f->desc->ground_tolerance_px;
    terrimp_node n = *node;
    uint32_t up;
    for (up = 0; up < 2u && n.level + 1u < tree->level_count; up++)
        n = terrimpi_tree_parent(tree, &n);
    beside = terrimpi_tree_kept(tree, n.number);
    if (beside)
        off = terrimpi_min(off, 2.0f * beside->rms * f->pixel_factor /
                                    terrimpi_max(closest, 1e-20f));
    error *= TERRIMPI_VIEW_STALE * f->pixel_factor * TERRIMP_SINF(f->desc->max_angle_rad) /
             terrimpi_max(closest - error, 1e-20f);
    return terrimpi_min(f->desc->tolerance_px, terrimpi_max(error, off));
}

enum {
    TERRIMPI_CULL_GROUND = 1,   /* the ground cut runs here */
    TERRIMPI_CULL_IMPOSTOR = 2, /* the impostor cut does, */
    TERRIMPI_CULL_SHORT = 4,    /* ... only because pages of its children are missing */
    TERRIMPI_CULL_EMPTY = 8     /* alone: it is in sight as a whole, but none of its parts are */
};

/* A node in sight. */
typedef struct terrimpi_cull_node {
    uint32_t number;
    uint32_t end;     /* behind the last one in it */
    float closest;    /* [wu] from the eye to its box */
    uint8_t level;
    uint8_t planes;   /* of the frustum, that may cut a part of it off */
    uint8_t cuts;
} terrimpi_cull_node;

/* All of them down to both cuts, each before those in it, closest first. */
typedef struct terrimpi_cull {
    terrimpi_cull_node *nodes; /* [capacity] */
    uint32_t capacity, count;
    uint32_t ground_count, impostor_count; /* with TERRIMPI_CULL_GROUND, _IMPOSTOR */
    uint32_t hidden_count;
    terrimp_hider *hider;      /* in use; NULL: none */
} terrimpi_cull;

/* Whether a node is hidden. What hides nodes has its place here: nodes come closest first. */
static int terrimpi_cull_hides(terrimpi_cull *cull, const terrimpi_frame *f,
                               const terrimp_node *node, int *planes, terrimp_box *box)
{
    terrimp_hider *hider;
    terrimpi_terrain_node_box(f->terrain, node, box);
    if (*planes)
        *planes = terrimp_frustum_test(&f->frustum, box, *planes);
    if (*planes == TERRIMP_PLANES_OUTSIDE)
        return 1;
    for (hider = cull->hider; hider; hider = hider->next)
        if (!hider->blind && hider->hides(hider, node)) {
            cull->hidden_count++;
            return 1;
        }
    return 0;
}

/* Whether the impostor cut runs at a node: far enough away, and small enough on the screen. A node
   that has a picture keeps its place for a little longer. Where smaller ones may be and pages of
   its children are missing it has to, with TERRIMPI_CULL_SHORT. */
static int terrimpi_cull_impostor(const terrimpi_frame *f, const terrimp_node *node, float closest,
                                  int has_picture, int smallest)
{
    const terrimp_heightfield *field = &f->terrain->desc.field;
    terrimpi_page_need need = {&f->frustum, f->eye, TERRIMP_WANT_GROUND, 0.0f, 0.0f};
    const struct terrimp_pages *pages = f->terrain->tree.pages;
    float side, sides = terrimpi_max(2.0f, f->pixel_factor / f->desc->impostor_px);
    if (!terrimpi_view_impostors(f->desc) || closest < f->desc->fade_start)
        return 0;
    if (f->camera.reach > 0.0f &&
        f->camera.reach > terrimpi_view_sine(f, node->number, closest) * closest)
        return 0; /* too much of what a picture may be off goes to how far eyes are apart */
    if (node->level == 0)
        return 1;
    if (f->terrain->real && /* and it is no repetition of a whole node */
        terrimpi_mesh_triangles(&f->terrain->meshes[node->number]) == 0)
        return 0;
    side = (float)(f->terrain->desc.chunk_quads << node->level) *
           terrimpi_max(field->spacing_x, field->spacing_z);
    if (f->desc->mode == TERRIMP_MODE_AUTO &&
        closest >= sides * (has_picture ? side / TERRIMPI_VIEW_STAY : side))
        return 1;
    return smallest || !pages || pages->calls->divides(f->terrain, node, &need)
               ? 0 : 1 + TERRIMPI_CULL_SHORT;
}

/* Whether the ground cut runs at a node; mip is NULL when ground is drawn at full resolution. */
static int terrimpi_cull_ground(const terrimpi_mip_frame *mip, const terrimp_node *node)
{
    return node->level == 0 || (mip && terrimpi_mip_ratio_of(mip, node->number) < 1.0f);
}

/* Whether any of a ground node's own terrain is in sight: not only its skirts. */
static int terrimpi_cull_shows_ground(const terrimpi_frame *f, const terrimpi_mip_frame *mip,
                                      const terrimp_node *node, int planes)
{
    terrimp_box box;
    if (!mip || !planes)
        return 1;
    terrimpi_mip_box(&f->terrain->tree, node, &box);
    return terrimp_frustum_test(&f->frustum, &box, planes) != TERRIMP_PLANES_OUTSIDE;
}

/* Says of each node where those in it end, and whether it is empty: then it need not be drawn. */
static void terrimpi_cull_close(terrimpi_cull *cull)
{
    uint32_t i, end;
    for (i = cull->count; i-- > 0;) {
        terrimpi_cull_node *n = cull->nodes;
        for (end = i + 1u; end < cull->count && n[end].level < n[i].level; end = n[end].end)
            if (n[end].cuts != TERRIMPI_CULL_EMPTY)
                n[i].cuts &= (uint8_t)~TERRIMPI_CULL_EMPTY;
        n[i].end = end;
        if (n[i].cuts & TERRIMPI_CULL_EMPTY)
            n[i].cuts = TERRIMPI_CULL_EMPTY;
    }
}

/* Which cuts run at a node in sight, of those that do not run above it. `done` gets them, and the
   impostor cut where the ground is too close for one. Where a choice is, and borders are lifted for
   one level only, impostors are no smaller than the ground's nodes: ground beside them would be
   coarser than that, see terrimpi_build_lift_border. (Where borders are lifted for two, so much is
   too dear: over the Pyrenees 10 % of the time at 1 px, and 0.7 dB.) */
static int terrimpi_cull_cuts(const terrimpi_frame *f, const terrimpi_cache *cache,
                              const terrimpi_mip_frame *mip, const terrimp_node *node, int planes,
                              float closest, int *done)
{
    int cuts = 0, impostor, smallest;
    if (!(*done & TERRIMPI_CULL_GROUND) && terrimpi_cull_ground(mip, node)) {
        cuts = terrimpi_cull_shows_ground(f, mip, node, planes) ? TERRIMPI_CULL_GROUND : 0;
        *done |= TERRIMPI_CULL_GROUND;
        if (closest < f->desc->fade_start || !terrimpi_view_impostors(f->desc))
            *done |= TERRIMPI_CULL_IMPOSTOR;
    }
    if (*done & TERRIMPI_CULL_IMPOSTOR)
        return cuts;
    smallest = *done && f->desc->mode == TERRIMP_MODE_AUTO &&
               terrimpi_mesh_lift(f->terrain->desc.chunk_quads) < 2u;
    impostor = terrimpi_cull_impostor(
        f, node, closest, cache->of_node[node->number] != TERRIMPI_CACHE_NO_PICTURE,
        smallest && (!mip || terrimpi_mip_ratio_of(mip, node->number) >= 0.0f));
    if (impostor)
        cuts |= TERRIMPI_CULL_IMPOSTOR | (impostor & TERRIMPI_CULL_SHORT);
    if (impostor || smallest)
        *done |= TERRIMPI_CULL_IMPOSTOR;
    return cuts;
}

/* How many nodes are in sight at most, when both cuts are full. Those in one direction are a row
   of, say, n; then those above them are n / 2 and so on, and one a level where the row ends. */
static size_t terrimpi_cull_capacity(const terrimp_quadtree *tree, size_t cuts)
{
    size_t most = 2u * cuts + 4u * tree->level_count;
    return most < tree->node_count ? most : tree->node_count;
}

/* Lists the nodes in sight. Which cuts a node lies below goes down the tree beside its planes.
   Returns 0 when there is more ground than may be. */
static int terrimpi_cull_walk(terrimpi_cull *cull, const terrimpi_frame *f,
                              const terrimpi_cache *cache, const terrimpi_mip_frame *mip)
{
    const int below = TERRIMP_PLANES_ALL + 1; /* a cut of 1 is this bit, one of 2 the next */
    const struct terrimp_pages *pages = f->terrain->tree.pages;
    terrimpi_tree_walk walk;
    terrimpi_tree_visit v;
    cull->count = cull->ground_count = cull->impostor_count = cull->hidden_count = 0;
    terrimpi_tree_begin(&walk, &f->terrain->tree, f->eye, TERRIMP_PLANES_ALL);
    while (terrimpi_tree_next(&walk, &v)) {
        terrimpi_cull_node *n = &cull->nodes[cull->count];
        int planes = v.planes % below, done = v.planes / below;
        terrimp_box box;
        if (terrimpi_cull_hides(cull, f, &v.node, &planes, &box))
            continue;
        if (pages)
            terrimpi_page_use(pages, v.node.number);
        if (cull->count++ == cull->capacity)
            return 0;
        if (cull->impostor_count > f->desc->max_impostors)
            done |= TERRIMPI_CULL_IMPOSTOR; /* of no use */
        n->number = v.node.number;
        n->level = (uint8_t)v.node.level;
        n->planes = (uint8_t)planes;
        n->closest = terrimpi_view_distance(f, &box);
        n->cuts = (uint8_t)terrimpi_cull_cuts(f, cache, mip, &v.node, planes, n->closest, &done);
        cull->ground_count += n->cuts & TERRIMPI_CULL_GROUND;
        cull->impostor_count += n->cuts & TERRIMPI_CULL_IMPOSTOR ? 1u : 0u;
        if (cull->ground_count > f->desc->max_ground)
            return 0;
        v.planes = planes + done * below;
        if (done == TERRIMPI_CULL_GROUND + TERRIMPI_CULL_IMPOSTOR)
            continue;
        n->cuts |= TERRIMPI_CULL_EMPTY; /* until its parts are listed */
        terrimpi_tree_enter(&walk, &v);
    }
    terrimpi_cull_close(cull);
    return 1;
}

/* Begins what hides nodes, with the ground that a walk without it has listed. That may be off its
   samples both where it hides and where it is hidden, so its error counts twice. A border that a
   node draws as its coarser neighbour does is no closer than that neighbour, whose error over its
   distance is here too. What a picture shows is off its place by the parallax error. */
static void terrimpi_cull_begin_hiders(const terrimpi_cull *cull, const terrimpi_frame *f, int full)
{
    terrimp_hider *hider;
    const terrimp_quadtree *tree = &f->terrain->tree;
    float error = 0.0f, low = 0.0f;
    uint32_t i;
    for (i = 0; i < cull->count && !full; i++) {
        terrimp_node n = terrimpi_tree_node(tree, cull->nodes[i].number);
        if (cull->nodes[i].cuts & TERRIMPI_CULL_GROUND)
            terrimpi_horizon_add_error(
                tree, terrimpi_horizon_node_error(tree, &n, f->desc->morph_ratio > 1.0f),
                cull->nodes[i].closest, &error, &low);
    }
    if (terrimpi_view_impostors(f->desc))
        error = terrimpi_max(error, TERRIMPI_VIEW_STALE * f->desc->tolerance_px / f->pixel_factor);
    for (hider = f->desc->hider; hider; hider = hider->next)
        hider->blind = 2.0f * error > 0.5f || !hider->begin(hider, &f->camera, 2.0f * error, low);
}

/* Lists the nodes in sight, without those that are hidden. */
static int terrimpi_cull_list(terrimpi_cull *cull, const terrimpi_frame *f,
                              const terrimpi_cache *cache, const terrimpi_mip_frame *mip)
{
    cull->hider = NULL;
    if (f->desc->hider) {
        if (mip && !terrimpi_cull_walk(cull, f, cache, mip))
            return 0;
        terrimpi_cull_begin_hiders(cull, f, !mip);
        cull->hider = f->desc->hider;
    }
    return terrimpi_cull_walk(cull, f, cache, mip);
}

/* ---- what things cost ---- */

static float terrimpi_cost_draw(const terrimp_costs *c, float triangles)
{
    return c->draw + c->triangle * triangles;
}

/* What shading so many pixels of one kind costs more than those of another. */
static float terrimpi_cost_shading(float pixels, float px, float other_px)
{
    return terrimpi_max(TERRIMPI_VIEW_SEEN * pixels * (px - other_px), 0.0f);
}

static float terrimpi_cost_capture(const terrimp_costs *c, float texels, float triangles)
{
    return c->capture + c->ground_px * texels + c->triangle * triangles;
}

/* ---- how good pictures are, and how long they last ---- */

/* How many frames a new picture of a node would last. */
static float terrimpi_view_life(const terrimpi_frame *f, uint32_t node, float closest)
{
    float way = f->desc->no_lookahead ? 1.0f : 1.0f + TERRIMPI_VIEW_AHEAD;
    float reach = way * closest * terrimpi_view_sine(f, node, closest);
    float life = reach / terrimpi_max(terrimpi_motion_speed(&f->motion, reach), 1e-20f);
    life = terrimpi_min(life, terrimpi_max(f->motion.since, f->motion.between));
    if (f->light_speed > 0.0f)
        life = terrimpi_min(life, f->light_tolerance / f->light_speed);
    return terrimpi_clamp(life, 1.0f, TERRIMPI_VIEW_LIFE);
}

static float terrimpi_view_sharpness(const terrimpi_frame *f, float closest)
{
    return f->pixel_factor * f->density / terrimpi_max(closest, 1e-6f * f->desc->fade_start);
}

/* The level of the ground that a picture is made of: the coarsest that shows no error in it. */
static uint32_t terrimpi_view_source(const terrimpi_frame *f, const terrimp_node *node,
                                     float closest, int *is_known)
{
    *is_known = 1;
    if (f->desc->mode == TERRIMP_MODE_IMPOSTOR)
        return 0;
    return terrimpi_capture_source(&f->terrain->tree, node,
                                   TERRIMPI_CAPTURE_SOURCE_TEXELS * closest /
                                       (f->pixel_factor * f->density), is_known);
}

/* Whether a slot may be as large as the softest picture of a camera. */
static int terrimpi_view_has_slot(const terrimpi_frame *f, const terrimp_capture *c)
{
    float side = terrimpi_max(c->tan_right - c->tan_left, c->tan_up - c->tan_down);
    return side * f->side_px * TERRIMPI_VIEW_SOFTEST * f->desc->texels_per_px <=
           (float)(f->desc->max_slot - 2u * TERRIMPI_CAPTURE_MARGIN);
}

/* Beyond which sides of the terrain a point lies, a bit each: none where another one goes on. */
static uint32_t terrimpi_view_beyond(const terrimpi_frame *f, const float point[3])
{
    const terrimp_box *box = &f->all;
    uint32_t beyond = 0;
    beyond |= point[2] < box->min[2] ? 1u << TERRIMP_SIDE_Z0 : 0u;
    beyond |= point[2] > box->max[2] ? 1u << TERRIMP_SIDE_Z1 : 0u;
    beyond |= point[0] < box->min[0] ? 1u << TERRIMP_SIDE_X0 : 0u;
    beyond |= point[0] > box->max[0] ? 1u << TERRIMP_SIDE_X1 : 0u;
    return beyond & ~f->desc->joined;
}

/* Whether all rays of an orthographic camera come in through the top of the terrain's box, and go
   out through its bottom. */
static int terrimpi_view_through(const terrimpi_frame *f)
{
    const float *forward = f->camera.forward;
    terrimp_capture c;
    int corner, top, k;
    if (!(forward[1] < 0.0f))
        return 0;
    terrimpi_camera_capture(&f->camera, &c);
    for (corner = 0; corner < 4; corner++)
        for (top = 0; top < 2; top++) {
            float at[3], way;
            for (k = 0; k < 3; k++)
                at[k] = c.eye[k] + c.right[k] * (corner & 1 ? c.tan_right : c.tan_left) +
                        c.up[k] * (corner & 2 ? c.tan_up : c.tan_down);
            way = ((top ? f->all.max[1] : f->all.min[1]) - at[1]) / forward[1];
            for (k = 0; k < 3; k++)
                at[k] += forward[k] * way;
            if (terrimpi_view_beyond(f, at))
                return 0;
        }
    return 1;
}

/* Whether an eye is on or over the ground. A ray that starts there passes through the ground before
   it meets the floor or a wall, which are below the ground everywhere; one that comes in below the
   terrain's outer border, or starts under the ground, does not. */
static int terrimpi_view_over(const terrimpi_frame *f, const float eye[3])
{
    float ground;
    uint32_t level;
    terrimp_heightfield here;
    terrimp_result result;
    if (f->camera.orthographic)
        return terrimpi_view_through(f);
    result = terrimpi_terrain_ground(f->terrain, eye[0], eye[2], &here, &ground, &level);
    if (result == TERRIMP_E_MISS)
        return !terrimpi_view_beyond(f, eye);
    return result == TERRIMP_OK && eye[1] - f->camera.reach >= ground;
}

/* Beyond which sides of the terrain the frame's eye is, as terrimpi_view_beyond; 0 where it has no
   place, or the terrain no end. */
static uint32_t terrimpi_view_beside(const terrimpi_frame *f)
{
    return f->camera.orthographic || f->terrain->real ? 0u
                                                      : terrimpi_view_beyond(f, f->camera.eye);
}

/* Where a picture is made from: ahead of the eye, so that its error falls before it grows again;
   but not from below when the eye is over the ground, since what a ray from there meets from behind
   would be missing. */
static void terrimpi_view_ahead(const terrimpi_frame *f, const terrimp_node *node,
                                const terrimp_box *box, float closest, float eye[3])
{
    const float *way = f->motion.away[0];
    float ahead, reach = closest * terrimpi_view_sine(f, node->number, closest);
    uint32_t i;
    memcpy(eye, f->eye, sizeof f->eye);
    if (f->desc->no_lookahead || !(terrimpi_length(way) > 0.0f))
        return;
    ahead = terrimpi_motion_speed(&f->motion, (1.0f + TERRIMPI_VIEW_AHEAD) * reach);
    ahead = terrimpi_min(TERRIMPI_VIEW_AHEAD * reach, ahead * 0.5f * TERRIMPI_VIEW_LIFE);
    for (i = 0; i < 3u; i++)
        eye[i] += way[i] / terrimpi_length(way) * ahead;
    if (terrimp_box_distance(box, eye) < TERRIMPI_VIEW_AHEAD_BOX * closest ||
        (terrimpi_view_over(f, f->eye) && !terrimpi_view_over(f, eye)))
        memcpy(eye, f->eye, sizeof f->eye);
}

/* The direction of an orthographic picture that is made from far along `eye`. */
static void terrimpi_view_along(const terrimpi_frame *f, const float eye[3], float forward[3])
{
    float away = f->pixel_factor / f->side_px, step;
    int i;
    for (i = 0; i < 3; i++) {
        step = eye[i] - f->eye[i];
        forward[i] = f->camera.forward[i] - step / away;
    }
}

/* How good a picture made from an eye is from the present one: its view angle and parallax error;
   returns the larger of the two over its limit. */
static float terrimpi_view_error(const terrimpi_frame *f, const terrimp_node *node,
                                 const float captured_eye[3], float *angle_rad, float *parallax_px)
{
    terrimp_box box;
    terrimpi_terrain_node_box(f->terrain, node, &box);
    *angle_rad = terrimpi_impostor_view_angle(&box, captured_eye, f->eye);
    if (f->camera.reach > 0.0f)
        *angle_rad += TERRIMP_ASINF(terrimpi_min(
            1.0f, f->camera.reach / terrimpi_max(terrimp_box_distance(&box, f->eye), 1e-20f)));
    *parallax_px = terrimpi_impostor_parallax_error(&box, terrimpi_view_mesh_error(f, node->number),
                                                    captured_eye, f->eye, f->camera.reach,
                                                    f->pixel_factor);
    return terrimpi_max(*angle_rad / f->desc->max_angle_rad,
                        *parallax_px / f->desc->tolerance_px);
}

/* Judges a picture, once a frame. */
static void terrimpi_view_judge(const terrimpi_frame *f, terrimpi_cache_picture *picture)
{
    if (picture->judged == f->number)
        return;
    picture->judged = f->number;
    picture->layers_now = picture->layer_count;
    picture->urgency = terrimpi_view_error(f, &picture->node, picture->eye, &picture->angle_rad,
                                           &picture->parallax_px);
}

/* How much a picture has to be renewed: from 1 on one of the criteria of Hess 3.5 is met, or it has
   become too coarse, or far too fine. */
static float terrimpi_view_urgency(const terrimpi_frame *f, terrimpi_cache_picture *picture,
                                   float closest)
{
    float urgency, wanted = terrimpi_view_sharpness(f, closest);
    terrimpi_view_judge(f, picture);
    urgency = terrimpi_max(picture->urgency, wanted / (picture->sharpness * TERRIMPI_VIEW_COARSE));
    urgency = terrimpi_max(urgency, picture->sharpness / (wanted * TERRIMPI_VIEW_FINE));
    return terrimpi_min(urgency, 1e6f);
}

/* The light's way since a picture was made over what the picture may wait for; from 1 on it is due.
   The golden ratio spreads what nodes of following numbers wait for. */
static float terrimpi_view_age(const terrimpi_frame *f, const terrimpi_cache_picture *p)
{
    float wait = 0.618034f * (float)(p->node.number & 0xffffu), way[3];
    if (p->expired || !(f->light_tolerance > 0.0f))
        return p->expired ? 1.0f : 0.0f;
    wait -= (float)(uint32_t)wait;
    terrimpi_sub(f->light, p->light, way);
    return terrimpi_length(way) / (f->light_tolerance *
                                   (f->desc->no_spreading
                                        ? 1.0f
                                        : 1.0f - (1.0f - TERRIMPI_VIEW_LIGHT_FIRST) * wait));
}

/* ---- regions, and what shows them ---- */

/* An impostor that would be good to have. */
typedef struct terrimpi_candidate {
    terrimp_node node;
    float closest;              /* [wu] from the eye to its box */
    float pixels;               /* that it covers, about */
    float urgency;              /* error of its picture over the tolerance */
    float life;                 /* [frames] that a new picture would last */
    float draw_cost, capture_cost;
    uint8_t is_short;           /* it stands for those below, whose pages are missing */
    uint8_t is_known;           /* what of the ground it would show */
    uint16_t rank;              /* among the captures of this frame, */
    float weight;               /* ... and within its rank */
    terrimpi_cache_picture *picture;  /* or NULL */
} terrimpi_candidate;

enum { TERRIMPI_JOB_RANK_EARLY = 0, TERRIMPI_JOB_RANK_DUE, TERRIMPI_JOB_RANK_MISSING };

/* Kinds of draws, in the order in which they are drawn. The first ones can show a region: see
   terrimpi_view_kinds. */
enum {
    TERRIMPI_VIEW_KIND_GROUND = 0,
    TERRIMPI_VIEW_KIND_IMPOSTOR,
    TERRIMPI_VIEW_KIND_SHOWS, /* that many kinds show regions */
    TERRIMPI_VIEW_KIND_FLOOR = TERRIMPI_VIEW_KIND_SHOWS,
    TERRIMPI_VIEW_KIND_SKIRTS,
    TERRIMPI_VIEW_KIND_COUNT
};

/* A part of the frame: the topmost node in one of the cuts. */
typedef struct terrimpi_region {
    uint32_t node;
    float closest;
    uint32_t first_ground, ground_count; /* of the ground draws, which stand in the order of all */
    terrimpi_candidate *candidates;
    uint16_t candidate_count;            /* none: ground is all it can be */
    uint8_t fits;                        /* there are some, and a camera fits round each */
    uint8_t kind;                        /* that shows it; until that is decided, whether its
                                            ground is coarser, since pages are missing */
    float pixels;                        /* that the candidates cover, about */
} terrimpi_region;

/* All of them, and what could be captured for them. */
typedef struct terrimpi_regions {
    terrimpi_region *items;         /* [max_ground + 1] front to back */
    terrimpi_candidate *candidates; /* [max_impostors] by region */
    uint32_t *queue;                /* [max_impostors] candidates to capture, most urgent first */
    uint32_t count, candidate_count;
} terrimpi_regions;

/* What a kind would cost a region. */
typedef struct terrimpi_region_offer {
    float draw;   /* each frame */
    float upkeep; /* captures, spread over the frames that they last */
} terrimpi_region_offer;

/* A command of the frame. */
typedef struct terrimpi_view_draw {
    int kind;
    uint32_t index; /* of the ground draw or the picture */
    float alpha;
} terrimpi_view_draw;

/* All of them. */
typedef struct terrimpi_view_draws {
    terrimpi_view_draw *items; /* [max_ground + max_impostors + 2] front to back */
    uint32_t count;
    uint32_t kind_count[TERRIMPI_VIEW_KIND_COUNT]; /* of each kind */
    uint32_t waiting;          /* impostors that have no picture yet */
} terrimpi_view_draws;

/* A capture of this frame, or a piece of one. */
typedef struct terrimpi_job {
    terrimpi_capture_plan plan;
    terrimpi_cache_picture *picture;
    terrimpi_cache_slot_place slots[TERRIMPI_CAPTURE_LAYERS];
    uint32_t from, to, end;        /* in rows of the plan's draws: of this piece, and of all */
    int in_pieces;                 /* it may be cut: its slot is not that of a picture in use */
    uint32_t triangles, texels;    /* of the whole picture */
    float sharpness, cost, light[3];
    uint8_t expired;               /* since its first piece was made */
} terrimpi_job;

/* All of them; of one that is made in pieces the next one comes first in the next frame. */
typedef struct terrimpi_jobs {
    terrimpi_job *items; /* [max_captures] */
    uint32_t count;
    uint32_t open;       /* 1 + the job of which pieces are missing */
} terrimpi_jobs;

/* What captures are prepared with, in the place of the nodes in sight: by then these are not needed
   any more. */
typedef struct terrimpi_view_room {
    terrimpi_capture_draw *draws; /* of one capture */
    float *xyz;                   /* [vertex_stride][3] of one mesh */
    uint16_t *indices;            /* [index_stride] */
} terrimpi_view_room;

struct terrimp_view {
    const terrimp_terrain *terrain, *built; /* what is drawn, and the host's: the same unless that
                                               wraps */
    terrimpi_cache cache;
    terrimpi_cull cull;
    uint8_t *kind_of;              /* [node_count] that showed the region */
    terrimpi_regions regions;
    terrimpi_jobs jobs;
    terrimpi_view_draws draws;
    terrimpi_view_room room;
    uint32_t late;                 /* nodes and pictures that pages are missing for */
    uint8_t outdated;              /* what this frame would draw has been forgotten */
    uint8_t capturing, lost;       /* captures are being made; one of them could not be */
    terrimp_geomip_view ground;
    float ground_scale;            /* of its tolerance: 1, or more when max_ground or max_cost are
                                      short */
    float cost;                    /* of the frame before */
    terrimp_view_desc desc;        /* resolved */
    terrimpi_frame frame;
    terrimp_stats stats;           /* as far as they are not counted when they are asked for */
    terrimp_terrain *tiled;        /* repetitions of one that wraps: then `terrain` is this; NULL */
#ifndef TERRIMP_NO_MALLOC
    terrimp_allocator allocator;
    size_t bytes;
#endif
};

/* ---- memory ---- */

static terrimp_live_atlas_desc terrimpi_view_atlas_desc(const terrimp_view_desc *d)
{
    terrimp_live_atlas_desc atlas;
    memset(&atlas, 0, sizeof atlas);
    atlas.width = atlas.height = d->atlas_size;
    atlas.max_slots = (d->max_impostors + d->max_captures) * /* old and new of what is renewed */
                      TERRIMPI_CAPTURE_LAYERS;
    return atlas;
}

static void terrimpi_view_room_layout(terrimpi_view_room *r, const terrimp_terrain *t,
                                      terrimpi_arena *l)
{
    r->draws = (terrimpi_capture_draw *)terrimpi_take(l, TERRIMPI_CAPTURE_DRAWS, sizeof *r->draws);
    r->xyz = (float *)terrimpi_take(l, t->vertex_stride, 3u * sizeof *r->xyz);
    r->indices = (uint16_t *)terrimpi_take(l, t->index_stride, sizeof *r->indices);
}

/* The one description of a view's block; as terrimpi_terrain_layout. */
static size_t terrimpi_view_layout(terrimp_view *v, unsigned char *base)
{
    size_t nodes = v->terrain->tree.node_count, impostors = v->desc.max_impostors;
    size_t ground = v->desc.max_ground, slots;
    terrimp_live_atlas_desc atlas = terrimpi_view_atlas_desc(&v->desc);
    terrimpi_arena l = terrimpi_arena_at(base);
    terrimpi_cache *c = &v->cache;
    terrimpi_regions *r = &v->regions;
    terrimpi_arena captures;
    size_t scratch;
    uint32_t i;
    c->atlas_count = v->desc.atlas_count;
    c->capacity = v->desc.max_impostors;
    c->node_count = v->terrain->tree.node_count;
    slots = terrimp_live_atlas_bytes(&atlas);
    terrimpi_take(&l, 1, sizeof *v);
    c->atlases = (terrimp_live_atlas *)terrimpi_take(&l, c->atlas_count, sizeof *c->atlases);
    for (i = 0; i < c->atlas_count; i++) {
        void *memory = terrimpi_take(&l, slots, 1);
        if (memory)
            terrimpi_atlas_init(&c->atlases[i], &atlas, memory);
    }
    c->of_node = (uint16_t *)terrimpi_take(&l, nodes, sizeof *c->of_node);
    c->pictures = (terrimpi_cache_picture *)terrimpi_take(&l, impostors, sizeof *c->pictures);
    c->places = NULL;
    c->exact = v->desc.exact_depth;
    if (c->exact)
        c->places = (terrimpi_cache_places *)terrimpi_take(&l, impostors, sizeof *c->places);
    v->ground.marks = (terrimp_geomip_mark *)terrimpi_take(&l, nodes, sizeof *v->ground.marks);
    v->ground.distances = (float *)terrimpi_take(&l, v->terrain->tree.pages ? 0 : nodes,
                                                 sizeof *v->ground.distances);
    v->ground.draws = (terrimp_geomip_draw *)terrimpi_take(&l, ground, sizeof *v->ground.draws);
    v->cull.capacity = (uint32_t)terrimpi_cull_capacity(&v->terrain->tree, ground + impostors);
    captures = terrimpi_arena_at(NULL);
    terrimpi_view_room_layout(&v->room, v->terrain, &captures);
    scratch = v->cull.capacity * sizeof *v->cull.nodes;
    scratch = captures.bytes > scratch ? captures.bytes : scratch;
    v->cull.nodes = (terrimpi_cull_node *)terrimpi_take(&l, scratch, 1);
    captures = terrimpi_arena_at((unsigned char *)v->cull.nodes);
    terrimpi_view_room_layout(&v->room, v->terrain, &captures);
    v->kind_of = (uint8_t *)terrimpi_take(&l, nodes, sizeof *v->kind_of);
    r->items = (terrimpi_region *)terrimpi_take(&l, ground + 1u, sizeof *r->items);
    r->candidates = (terrimpi_candidate *)terrimpi_take(&l, impostors, sizeof *r->candidates);
    r->queue = (uint32_t *)terrimpi_take(&l, impostors, sizeof *r->queue);
    v->jobs.items = (terrimpi_job *)terrimpi_take(&l, v->desc.max_captures,
                                                 sizeof *v->jobs.items);
    v->draws.items = (terrimpi_view_draw *)terrimpi_take(
        &l, ground + impostors + (v->tiled ? v->desc.wrap_tiles * v->desc.wrap_tiles : 2u),
        sizeof *v->draws.items);
    if (v->tiled)
        v->terrain = v->tiled = v->desc.endless->layout(v->tiled, v->built, &l);
    return l.ok && slots ? l.bytes : 0;
}

/* What is drawn: the terrain, or in its place `tiled`, to be laid out. */
static void terrimpi_view_begin(terrimp_view *v, const terrimp_terrain *terrain,
                                terrimp_terrain *tiled)
{
    v->terrain = v->built = terrain;
    v->tiled = NULL;
    if (!terrain->desc.field.wrap)
        return;
    v->desc.endless->begin(terrain, v->desc.wrap_tiles, tiled);
    tiled->endless = v->desc.endless;
    v->terrain = v->tiled = tiled;
}

TERRIMP_API size_t terrimp_view_bytes(const terrimp_terrain *terrain, const terrimp_view_desc *desc)
{
    terrimp_view v;
    terrimp_terrain tiled;
    if (terrimp_view_desc_resolve(terrain, desc, &v.desc) != TERRIMP_OK)
        return 0;
    terrimpi_view_begin(&v, terrain, &tiled);
    return terrimpi_view_layout(&v, NULL);
}

static void terrimpi_view_set_ground(const terrimp_view_desc *d, terrimp_geomip_view *ground)
{
    ground->rule = d->ground_rule;
    ground->morph_ratio = d->morph_ratio;
    ground->tolerance_px = d->ground_tolerance_px;
    ground->hysteresis = TERRIMPI_VIEW_HYSTERESIS;
}

TERRIMP_API terrimp_result terrimp_view_init(const terrimp_terrain *terrain,
                                             const terrimp_view_desc *desc, void *memory,
                                             size_t bytes, terrimp_view **view)
{
    terrimp_view v, *made = (terrimp_view *)memory;
    terrimp_terrain tiled;
    size_t needed;
    TERRIMPI_REFUSE(!view, TERRIMP_E_NULL);
    memset(&v, 0, sizeof v);
    TERRIMPI_TRY(terrimp_view_desc_resolve(terrain, desc, &v.desc));
    terrimpi_view_begin(&v, terrain, &tiled);
    needed = terrimpi_view_layout(&v, NULL);
    TERRIMPI_REFUSE(needed == 0, TERRIMP_E_OVERFLOW);
    TERRIMPI_TRY(terrimpi_check_block(memory, bytes, needed));
    memset(memory, 0, needed);
    terrimpi_view_layout(&v, (unsigned char *)memory);
    v.ground.draw_capacity = v.desc.max_ground;
    v.ground_scale = 1.0f;
    terrimpi_view_set_ground(&v.desc, &v.ground);
    v.frame.density = v.desc.texels_per_px;
    v.frame.desc = &made->desc;
    v.frame.terrain = v.terrain;
    *made = v;
    *view = made;
    return terrimp_view_invalidate(made);
}

TERRIMP_API terrimp_result terrimp_view_set(terrimp_view *view, const terrimp_view_desc *desc)
{
    terrimp_view_desc d;
    const terrimp_view_desc *has;
    TERRIMPI_REFUSE(!view || !desc, TERRIMP_E_NULL);
    has = &view->desc;
    d = *desc;
    TERRIMPI_DEFAULT(d.atlas_size, has->atlas_size);
    TERRIMPI_DEFAULT(d.atlas_count, has->atlas_count);
    TERRIMPI_DEFAULT(d.max_impostors, has->max_impostors);
    TERRIMPI_DEFAULT(d.max_ground, has->max_ground);
    TERRIMPI_DEFAULT(d.max_captures, has->max_captures);
    TERRIMPI_DEFAULT(d.wrap_tiles, has->wrap_tiles);
    if (!d.endless)
        d.endless = has->endless;
    TERRIMPI_TRY(terrimp_view_desc_resolve(view->terrain, &d, &d));
    TERRIMPI_REFUSE(d.atlas_size != has->atlas_size || d.atlas_count != has->atlas_count ||
                    d.max_impostors != has->max_impostors || d.max_ground != has->max_ground ||
                    d.max_captures != has->max_captures || d.wrap_tiles != has->wrap_tiles ||
                    d.endless != has->endless || (d.exact_depth && !view->cache.places),
                    TERRIMP_E_RANGE);
    view->desc = d;
    terrimpi_view_set_ground(&view->desc, &view->ground);
    return TERRIMP_OK;
}

/* ---- captures that are not made ---- */

/* Gives back what a job has taken, unless that is what its picture has. */
static void terrimpi_job_cancel(terrimpi_cache *cache, const terrimpi_job *job)
{
    const terrimpi_cache_picture *p = job->picture;
    if (p->layer_count != job->plan.layer_count ||
        memcmp(job->slots, p->slots, p->layer_count * sizeof *p->slots) != 0)
        terrimpi_cache_free(cache, job->slots, job->plan.layer_count);
}

/* Forgets the jobs of a frame that is not rendered, but for a picture that has been begun: that one
   becomes the first. */
static void terrimpi_jobs_cancel(terrimpi_cache *cache, terrimpi_jobs *jobs)
{
    uint32_t i;
    for (i = 0; i < jobs->count; i++) {
        if (jobs->open == i + 1u && jobs->items[i].from > 0)
            continue;
        terrimpi_job_cancel(cache, &jobs->items[i]);
        if (jobs->open == i + 1u)
            jobs->open = 0;
    }
    jobs->count = 0;
    if (jobs->open) {
        jobs->items[0] = jobs->items[jobs->open - 1u];
        jobs->open = 1;
    }
}

/* ---- a terrain without end ---- */

/* One that wraps is drawn as a terrain of tiles x tiles repetitions around the eye's, with a tree
   of its own; what is kept of nodes is copied into that. A node of it that is no repetition of a
   whole node, because it is too large, is never fine enough to be drawn. The eye is always in the
   tile in the middle: where it leaves it, pictures and marks move by a tile instead. */
static int terrimpi_tiled_fits(const terrimp_terrain *built, const terrimp_view_desc *d)
{
    uint32_t cols = built->desc.field.width - 1u, rows = built->desc.field.depth - 1u;
    return terrimpi_within_u32(d->wrap_tiles, 3, 15) && d->wrap_tiles % 2u == 1u && !d->hider &&
           !built->tree.pages && cols % built->desc.chunk_quads == 0 &&
           rows % built->desc.chunk_quads == 0 && cols * d->wrap_tiles < TERRIMP_MAX_DIM &&
           rows * d->wrap_tiles < TERRIMP_MAX_DIM;
}

static void terrimpi_tiled_begin(const terrimp_terrain *built, uint32_t tiles, terrimp_terrain *t)
{
    terrimp_heightfield field = built->desc.field;
    *t = *built;
    t->tiles = tiles;
    field.origin_x -= (float)(t->tiles / 2u) * terrimpi_field_period(&field, 0);
    field.origin_z -= (float)(t->tiles / 2u) * terrimpi_field_period(&field, 1);
    field.width = (field.width - 1u) * t->tiles + 1u;
    field.depth = (field.depth - 1u) * t->tiles + 1u;
    field.row_bytes = 0; /* no sample is read through it */
    (void)terrimp_quadtree_init(&field, t->desc.chunk_quads, &t->tree);
}

static void terrimpi_tiled_fill(terrimp_terrain *t, const terrimp_terrain *real)
{
    const terrimp_quadtree *from = &real->tree;
    uint32_t i, chunks = from->level_x[0] | from->level_z[0];
    terrimp_node root = terrimpi_tree_root(from);
    terrimpi_mesh none = real->meshes[root.number];
    terrimp_geomip_node split = from->nodes[root.number];
    none.counts = 0;
    none.error = none.error_rms = split.error = split.rms = TERRIMPI_MIP_MOST;
    for (i = 0; i < t->tree.node_count; i++) {
        terrimp_node n = terrimpi_tree_node(&t->tree, i);
        int whole = n.level < from->level_count && chunks % (1u << n.level) == 0;
        t->real[i] = whole ? terrimpi_tree_at(from, n.level, n.x % from->level_x[n.level],
                                              n.z % from->level_z[n.level]).number : root.number;
        t->meshes[i] = whole ? real->meshes[t->real[i]] : none;
        t->tree.nodes[i] = whole ? from->nodes[t->real[i]] : split;
    }
}

/* Lays it out and fills it in, if there is memory; returns where it is then. */
static terrimp_terrain *terrimpi_tiled_layout(terrimp_terrain *t, const terrimp_terrain *built,
                                              terrimpi_arena *l)
{
    size_t nodes = t->tree.node_count;
    terrimp_terrain *to = (terrimp_terrain *)terrimpi_take(l, 1, sizeof *to), made = *t;
    made.real = (uint32_t *)terrimpi_take(l, nodes, sizeof *made.real);
    made.meshes = (terrimpi_mesh *)terrimpi_take(l, nodes, sizeof *made.meshes);
    made.tree.nodes = (terrimp_geomip_node *)terrimpi_take(l, nodes, sizeof *made.tree.nodes);
    if (!to)
        return t;
    *to = made;
    terrimpi_tiled_fill(to, built);
    return to;
}

static terrimp_node terrimpi_tiled_place(const terrimp_terrain *t, const terrimp_node *node,
                                         const float middle[2], float offset[2])
{
    const terrimp_heightfield *field = &t->desc.field;
    uint32_t across = t->tree.level_x[node->level] / t->tiles;
    uint32_t along = t->tree.level_z[node->level] / t->tiles;
    uint32_t quads = t->desc.chunk_quads << node->level;
    terrimp_node n = *node;
    offset[0] = middle[0] + terrimpi_field_period(field, 0) *
                ((float)(node->x * quads / (field->width - 1u)) - (float)(t->tiles / 2u));
    offset[1] = middle[1] + terrimpi_field_period(field, 1) *
                ((float)(node->z * quads / (field->depth - 1u)) - (float)(t->tiles / 2u));
    n.number = t->real[n.number];
    n.x %= across;
    n.z %= along;
    return n;
}

/* Moves what is known of nodes by (x, z) tiles: what was at node n + tiles is at n. Returns the
   node that a node was, or node_count when it was none. */
static uint32_t terrimpi_tiled_before(const terrimp_terrain *t, const terrimp_node *n, int32_t x,
                                      int32_t z)
{
    const terrimp_quadtree *tree = &t->tree;
    uint32_t was_x = n->x + (uint32_t)(x * (int32_t)(tree->level_x[n->level] / t->tiles));
    uint32_t was_z = n->z + (uint32_t)(z * (int32_t)(tree->level_z[n->level] / t->tiles));
    if (terrimpi_mesh_triangles(&t->meshes[n->number]) == 0 ||
        !terrimpi_tree_has(tree, n->level, was_x, was_z))
        return tree->node_count;
    return terrimpi_tree_at(tree, n->level, was_x, was_z).number;
}

/* Takes a camera into the tile in the middle, and what is known of nodes by as many tiles as it has
   gone since the frame before, by the shorter way. Of the step of the eye what is left are world
   units without tiles. */
static void terrimpi_tiled_enter(terrimp_view *v, terrimp_camera *camera, float middle[2])
{
    const terrimp_terrain *t = v->terrain;
    uint32_t count = t->tree.node_count, i;
    terrimpi_cache_picture *p;
    int32_t went[2];
    float way[2];
    int k, up;
    for (k = 0; k < 2; k++) {
        float period = terrimpi_field_period(&t->desc.field, k), step;
        middle[k] = period * terrimpi_field_wrap(&t->desc.field, k, &camera->eye[2 * k]);
        step = (v->frame.camera.eye[2 * k] - camera->eye[2 * k]) / period;
        went[k] = v->frame.number == 0 ? 0 : step > 0.5f ? 1 : step < -0.5f ? -1 : 0;
        way[k] = (float)went[k] * period;
    }
    if (!went[0] && !went[1])
        return;
    up = went[1] > 0 || (went[1] == 0 && went[0] > 0);
    for (k = 0; k < 2; k++) {
        v->frame.camera.eye[2 * k] -= way[k];
        v->frame.eye[2 * k] -= way[k];
    }
    v->outdated = 1; /* its draws are of nodes that are elsewhere now */
    terrimpi_jobs_cancel(&v->cache, &v->jobs);
    if (v->jobs.open)
        terrimpi_job_cancel(&v->cache, &v->jobs.items[0]);
    v->jobs.open = 0;
    for (i = 0; i < count; i++) { /* from which they come is later in this direction */
        terrimp_node n = terrimpi_tree_node(&t->tree, up ? i : count - 1u - i);
        uint32_t was = terrimpi_tiled_before(t, &n, went[0], went[1]);
        int is = was < count;
        v->kind_of[n.number] = is ? v->kind_of[was] : (unsigned char)TERRIMPI_VIEW_KIND_GROUND;
        v->ground.marks[n.number].measure = is ? v->ground.marks[was].measure : 0.0f;
        v->ground.marks[n.number].frame = is ? v->ground.marks[was].frame : 0;
    }
    for (p = v->cache.pictures; p < v->cache.pictures + v->cache.capacity; p++)
        if (p->seen)
            v->cache.of_node[p->node.number] = TERRIMPI_CACHE_NO_PICTURE;
    for (p = v->cache.pictures; p < v->cache.pictures + v->cache.capacity; p++) {
        terrimp_node n = p->node;
        uint32_t now = p->seen ? terrimpi_tiled_before(t, &n, -went[0], -went[1]) : count;
        if (!p->seen)
            continue;
        if (now == count) {
            uint16_t *at = &v->cache.of_node[n.number], other = *at;
            terrimpi_cache_drop(&v->cache, p);
            *at = other;
            continue;
        }
        p->node = terrimpi_tree_node(&t->tree, now);
        for (k = 0; k < 2; k++)
            p->eye[2 * k] -= way[k];
        v->cache.of_node[now] = (uint16_t)(p - v->cache.pictures);
    }
}

TERRIMP_API const terrimp_endless *terrimp_view_endless(void)
{
    static const terrimp_endless calls = {
        terrimpi_tiled_fits, terrimpi_tiled_begin, terrimpi_tiled_layout, terrimpi_tiled_fill,
        terrimpi_tiled_enter, terrimpi_tiled_place
    };
    return &calls;
}

/* ---- what a host says of pictures and light ---- */

TERRIMP_API terrimp_result terrimp_view_invalidate(terrimp_view *view)
{
    TERRIMPI_REFUSE(!view, TERRIMP_E_NULL);
    terrimpi_cache_clear(&view->cache);
    terrimpi_motion_lose(&view->frame.motion);
    view->jobs.count = view->jobs.open = 0;
    view->outdated = 1;
    return TERRIMP_OK;
}

/* Forgets a picture, and what of it has been begun. */
static void terrimpi_jobs_forget(terrimpi_cache *cache, terrimpi_jobs *jobs,
                                 terrimpi_cache_picture *p)
{
    if (jobs->open && jobs->items[jobs->open - 1u].picture == p) {
        terrimpi_job_cancel(cache, &jobs->items[jobs->open - 1u]);
        jobs->open = 0;
    }
    terrimpi_cache_drop(cache, p);
}

/* The same for all that are lost. */
static void terrimpi_jobs_lose(terrimpi_cache *cache, terrimpi_jobs *jobs)
{
    terrimpi_cache_picture *p;
    for (p = cache->pictures; p < cache->pictures + cache->capacity; p++)
        if (p->lost)
            terrimpi_jobs_forget(cache, jobs, p);
}

/* Marks the picture of a node, or all, as lost, else as expired. Pieces of one that is being made
   are older than that. */
static terrimp_result terrimpi_view_mark(terrimp_view *v, uint32_t node, int lost)
{
    terrimpi_job *open;
    terrimpi_cache_picture *p;
    TERRIMPI_REFUSE(!v, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(node != TERRIMP_EVERY_NODE && node >= v->built->tree.node_count,
                    TERRIMP_E_RANGE);
    open = v->jobs.open ? &v->jobs.items[v->jobs.open - 1u] : NULL;
    for (p = v->cache.pictures; p < v->cache.pictures + v->cache.capacity; p++) {
        if (p->seen == 0 || (node != TERRIMP_EVERY_NODE &&
                             terrimpi_real_node(v->terrain, p->node.number) != node))
            continue;
        *(lost ? &p->lost : &p->expired) = 1;
        if (open && open->picture == p && open->from > 0)
            open->expired = 1;
    }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_view_touch(terrimp_view *view, uint32_t x, uint32_t z,
                                              uint32_t cols, uint32_t rows)
{
    const terrimp_quadtree *tree;
    terrimpi_cache_picture *p;
    uint32_t tiles, k;
    TERRIMPI_REFUSE(!view, TERRIMP_E_NULL);
    tree = &view->built->tree;
    tiles = view->terrain->real ? view->desc.wrap_tiles : 1u;
    TERRIMPI_REFUSE(x >= tree->field.width || z >= tree->field.depth || cols == 0 ||
                    rows == 0, TERRIMP_E_RANGE);
    cols = terrimpi_min_u32(cols, tree->field.width - x);
    rows = terrimpi_min_u32(rows, tree->field.depth - z);
    terrimpi_jobs_cancel(&view->cache, &view->jobs);
    view->outdated = 1;
    if (view->tiled)
        view->desc.endless->fill(view->tiled, view->built);
    for (p = view->cache.pictures; p < view->cache.pictures + view->cache.capacity; p++)
        for (k = 0; k < tiles * tiles; k++)
            if (terrimpi_cache_shows(p, tree->chunk_quads,
                                     x + k % tiles * (tree->field.width - 1u),
                                     z + k / tiles * (tree->field.depth - 1u), cols, rows))
                terrimpi_jobs_forget(&view->cache, &view->jobs, p);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_view_drop(terrimp_view *view, uint32_t node)
{
    TERRIMPI_TRY(terrimpi_view_mark(view, node, 1));
    view->lost = view->capturing;
    if (view->capturing)
        return TERRIMP_OK;
    terrimpi_jobs_cancel(&view->cache, &view->jobs);
    view->outdated = 1;
    terrimpi_jobs_lose(&view->cache, &view->jobs);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_view_expire(terrimp_view *view, uint32_t node)
{
    return terrimpi_view_mark(view, node, 0);
}

TERRIMP_API terrimp_result terrimp_view_light(terrimp_view *view, const float direction[3],
                                              float tolerance_rad)
{
    float light[3] = {0.0f, 0.0f, 0.0f}, step[3];
    terrimpi_frame *f;
    TERRIMPI_REFUSE(!view, TERRIMP_E_NULL);
    f = &view->frame;
    if (direction) {
        TERRIMPI_REFUSE(!terrimpi_finite3(direction) || !terrimpi_finite(tolerance_rad),
                        TERRIMP_E_NOT_FINITE);
        memcpy(light, direction, sizeof light);
        if (tolerance_rad == 0.0f)
            tolerance_rad = TERRIMPI_VIEW_LIGHT;
        TERRIMPI_REFUSE(!terrimpi_within(tolerance_rad, 0.001f, 3.1f) ||
                        !terrimpi_normalize(light), TERRIMP_E_RANGE);
    }
    terrimpi_sub(light, f->light, step);
    f->light_step = terrimpi_length(step);
    if (!direction)
        f->light_speed = f->light_step = 0.0f;
    else if (f->light_step > tolerance_rad) { /* a jump is no motion */
        f->light_step = 0.0f;
        terrimpi_motion_lose(&f->motion);
    }
    memcpy(f->light, light, sizeof light);
    f->light_tolerance = direction ? 2.0f * TERRIMP_SINF(0.5f * tolerance_rad) : 0.0f;
    return TERRIMP_OK;
}

/* ---- the regions ---- */

/* Makes the ground draw of a node in the ground cut. */
static void terrimpi_view_add_ground(terrimp_geomip_view *ground, terrimpi_mip_frame *mip,
                                     const terrimp_node *node)
{
    terrimp_geomip_draw *draw = &ground->draws[ground->draws_needed];
    if (mip) {
        terrimpi_mip_emit(mip, node);
        return;
    }
    memset(draw, 0, sizeof *draw);
    draw->node = *node;
    ground->draws_needed++;
}

/* Makes a region of the nodes [at, end) in sight, of which the first is in one of the cuts. What is
   in sight has ground. With too many impostors it has none. */
static void terrimpi_regions_add(const terrimpi_frame *f, const terrimpi_cull_node *nodes,
                                 uint32_t at, terrimp_geomip_view *ground,
                                 terrimpi_mip_frame *mip, terrimpi_regions *regions)
{
    terrimpi_region *region = &regions->items[regions->count];
    uint32_t first = regions->candidate_count, i, end;
    memset(region, 0, sizeof *region);
    region->node = nodes[at].number;
    region->closest = nodes[at].closest;
    region->first_ground = ground->draws_needed;
    region->candidates = regions->candidates + first;
    for (i = at, end = nodes[at].end; i < end; i++) {
        terrimp_node node = terrimpi_tree_node(&f->terrain->tree, nodes[i].number);
        if (nodes[i].cuts & TERRIMPI_CULL_GROUND)
            terrimpi_view_add_ground(ground, mip, &node);
        region->kind |= (uint8_t)(mip && terrimpi_mip_ratio_of(mip, node.number) < 0.0f);
        if (!(nodes[i].cuts & TERRIMPI_CULL_IMPOSTOR))
            continue;
        if (regions->candidate_count < f->desc->max_impostors) {
            terrimpi_candidate *c = &regions->candidates[regions->candidate_count];
            memset(c, 0, sizeof *c);
            c->node = node;
            c->closest = nodes[i].closest;
            c->is_short = (nodes[i].cuts & TERRIMPI_CULL_SHORT) != 0;
        }
        regions->candidate_count++;
    }
    region->ground_count = ground->draws_needed - region->first_ground;
    if (region->ground_count == 0 || regions->candidate_count > f->desc->max_impostors)
        regions->candidate_count = first;
    region->candidate_count = (uint16_t)(regions->candidate_count - first);
    regions->count += region->ground_count > 0 ? 1u : 0u;
}

static void terrimpi_regions_make(const terrimpi_frame *f, const terrimpi_cull *cull,
                                  terrimp_geomip_view *ground, terrimpi_mip_frame *mip,
                                  terrimpi_regions *regions)
{
    uint32_t i = 0;
    regions->count = regions->candidate_count = 0;
    ground->draws_needed = ground->triangle_count = 0;
    while (i < cull->count)
        if (cull->nodes[i].cuts & ~TERRIMPI_CULL_EMPTY) {
            terrimpi_regions_add(f, cull->nodes, i, ground, mip, regions);
            i = cull->nodes[i].end;
        } else {
            i++;
        }
    ground->draw_count = ground->draws_needed;
}

/* Finds what is in sight and makes both cuts through it; where max_ground is too small, at a larger
   tolerance. The frame before is only written over when that has succeeded. */
static terrimp_result terrimpi_view_cut(terrimp_view *v, const terrimpi_frame *f)
{
    struct terrimp_pages *pages = f->terrain->tree.pages;
    terrimpi_mip_frame mip;
    mip.whole = 0.0f;
    mip.bound = v->desc.ground_rule == TERRIMP_GEOMIP_BOUND ? v->desc.bound : NULL;
    if (terrimpi_view_full(&v->desc) && pages) { /* not all is here: to be balanced */
        const terrimp_heightfield *field = &f->terrain->desc.field;
        mip.whole = v->desc.mode == TERRIMP_MODE_FULL
                        ? -1.0f : v->desc.fade_start + 4.0f * (float)v->terrain->desc.chunk_quads *
                                      terrimpi_max(field->spacing_x, field->spacing_z);
    } else if (terrimpi_view_full(&v->desc)) {
        if (!terrimpi_cull_list(&v->cull, f, &v->cache, NULL))
            return TERRIMP_E_CAPACITY;
        terrimpi_regions_make(f, &v->cull, &v->ground, NULL, &v->regions);
        return TERRIMP_OK;
    }
    for (;;) {
        float most = TERRIMPI_VIEW_COARSEST / v->desc.ground_tolerance_px;
        float scale = terrimpi_min(v->ground_scale, most);
        terrimpi_mip_mark(&mip, &f->terrain->tree, &v->ground, &f->camera, scale);
        if (pages)
            v->late = pages->calls->settle(f->terrain, &mip, f->desc->hider != NULL);
        TERRIMPI_REFUSE(pages && !terrimpi_page_of(pages, f->terrain->tree.node_count - 1u),
                        TERRIMP_E_PAGE); /* but what it needs beside the root's is wanted */
        if (terrimpi_cull_list(&v->cull, f, &v->cache, &mip))
            break;
        if (v->ground_scale >= most || mip.whole < 0.0f)
            return TERRIMP_E_CAPACITY;
        v->ground_scale *= TERRIMPI_VIEW_COARSER;
    }
    terrimpi_regions_make(f, &v->cull, &v->ground,
                          mip.whole < 0.0f && v->late == 0 ? NULL : &mip, &v->regions);
    if (pages && !f->desc->no_lookahead && f->motion.frames[0] > 0.0f)
        pages->calls->look_ahead(f->terrain, &mip, f->motion.away[0],
                                 TERRIMPI_VIEW_SOON / f->motion.frames[0]);
    return TERRIMP_OK;
}

/* ---- ground or impostors? ---- */

/* Fills in what a candidate costs. Returns 0 when no camera fits, since the eye is too close, or no
   slot. */
static int terrimpi_candidate_estimate(const terrimpi_frame *f, const terrimpi_cache *cache,
                                       terrimpi_candidate *c)
{
    const terrimp_costs *costs = &f->desc->costs;
    float k = f->side_px;
    terrimp_capture camera;
    terrimp_mesh_info mesh;
    terrimp_box box;
    uint32_t quads, source;
    int is_known;
    terrimpi_terrain_node_box(f->terrain, &c->node, &box);
    if (terrimpi_terrain_stale(f->terrain, c->node.number)) /* its mesh is not of this ground */
        return 0;
    if (terrimpi_camera_fit(&box, f->camera.eye,
                            f->camera.orthographic ? f->camera.forward : NULL, &camera) !=
            TERRIMP_OK || !terrimpi_view_has_slot(f, &camera))
        return 0;
    terrimpi_mesh_place(f->terrain, c->node.number, &mesh);
    c->picture = terrimpi_cache_find(cache, c->node.number);
    c->is_known = 1;
    c->pixels = k * k * (camera.tan_right - camera.tan_left) * (camera.tan_up - camera.tan_down);
    c->draw_cost = terrimpi_cost_draw(costs, (float)(mesh.index_count / 3u));
    c->life = terrimpi_view_life(f, c->node.number, c->closest);
    if (c->picture && c->picture->layer_count > 0) {
        c->capture_cost = c->picture->cost;
        c->urgency = terrimpi_max(terrimpi_view_urgency(f, c->picture, c->closest),
                                  terrimpi_min(terrimpi_view_age(f, c->picture),
                                               TERRIMPI_VIEW_AGED * TERRIMPI_VIEW_STALE));
        return 1;
    }
    c->urgency = 1e9f;
    source = terrimpi_view_source(f, &c->node, c->closest, &is_known);
    c->is_known = (uint8_t)is_known;
    quads = f->terrain->desc.chunk_quads << (c->node.level - source);
    c->capture_cost = terrimpi_cost_capture(costs, c->pixels * f->density * f->density,
                                            TERRIMPI_VIEW_BORDER * (float)(quads * quads));
    return 1;
}

/* Whether a candidate has a picture that may be drawn. */
static int terrimpi_candidate_ready(const terrimpi_candidate *c)
{
    return c->picture && c->picture->layer_count > 0 && c->urgency < TERRIMPI_VIEW_STALE;
}

/* Fills in a region's candidates and the pixels that they cover. Both kinds shade the same ones:
   what that costs alike is left out, or it would hide how much dearer the rest of one is. */
static void terrimpi_region_measure(const terrimpi_frame *f, const terrimpi_cache *cache,
                                    terrimpi_region *region)
{
    uint32_t i;
    region->fits = region->candidate_count > 0;
    region->pixels = 0.0f;
    for (i = 0; i < region->candidate_count && region->fits; i++) {
        region->fits = (uint8_t)terrimpi_candidate_estimate(f, cache, &region->candidates[i]);
        region->pixels += region->candidates[i].pixels;
    }
}

static int terrimpi_view_ground_estimate(const terrimpi_frame *f, const terrimpi_region *region,
                                         terrimpi_region_offer *offer)
{
    const terrimp_costs *costs = &f->desc->costs;
    float quads = (float)f->terrain->desc.chunk_quads;
    offer->draw = (float)region->ground_count * terrimpi_cost_draw(costs, 2.0f * quads * quads) +
                  terrimpi_cost_shading(region->pixels, costs->ground_px, costs->impostor_px);
    offer->upkeep = 0.0f;
    return 1;
}

static int terrimpi_view_impostor_estimate(const terrimpi_frame *f, const terrimpi_region *region,
                                           terrimpi_region_offer *offer)
{
    const terrimp_costs *costs = &f->desc->costs;
    const terrimpi_candidate *c = region->candidates;
    float wait = terrimpi_length(f->motion.away[0]) > 0.0f ? TERRIMPI_VIEW_SHORT : 0.0f;
    uint32_t i;
    offer->draw = offer->upkeep = 0.0f;
    for (i = 0; i < region->candidate_count && region->fits; i++, c++) {
        offer->draw += c->draw_cost;
        offer->upkeep += c->capture_cost / c->life * (c->is_short ? 1.0f + wait / c->life : 1.0f);
    }
    offer->draw += terrimpi_cost_shading(region->pixels, costs->impostor_px, costs->ground_px);
    return region->fits;
}

static int terrimpi_view_ground_ready(const terrimpi_region *region)
{
    (void)region;
    return 1;
}

static int terrimpi_view_impostor_ready(const terrimpi_region *region)
{
    uint32_t i;
    for (i = 0; i < region->candidate_count; i++)
        if (!terrimpi_candidate_ready(&region->candidates[i]))
            return 0;
    return 1;
}

/* ---- the draw list ---- */

static void terrimpi_view_add(terrimpi_view_draws *list, int kind, uint32_t index)
{
    terrimpi_view_draw *draw = &list->items[list->count++];
    draw->kind = kind;
    draw->index = index;
    draw->alpha = 1.0f;
}

static int terrimpi_view_ground_list(const terrimpi_frame *f, terrimpi_cache *cache,
                                     const terrimpi_region *region, terrimpi_view_draws *list)
{
    uint32_t i;
    (void)f;
    (void)cache;
    for (i = 0; i < region->ground_count; i++)
        terrimpi_view_add(list, TERRIMPI_VIEW_KIND_GROUND, region->first_ground + i);
    return 1;
}

/* Lists a node's impostor, once, if it has a picture that is good. One that is drawn for several
   regions does not fade. */
static int terrimpi_view_impostor_add(const terrimpi_frame *f, terrimpi_cache *cache,
                                      const terrimp_node *node, terrimpi_view_draws *list)
{
    terrimpi_cache_picture *p = terrimpi_cache_find(cache, node->number);
    const terrimp_quadtree *tree = &f->terrain->tree;
    if (!p || (tree->pages && !tree->pages->calls->want(tree, node->number, 0, 0.0f)))
        return 0;
    if (p->listed == f->number) {
        list->items[p->draw].alpha = 1.0f;
        return 1;
    }
    terrimpi_view_judge(f, p);
    if (p->layers_now == 0 || p->urgency > TERRIMPI_VIEW_STALE)
        return 0;
    p->listed = p->seen = f->number;
    p->draw = list->count;
    terrimpi_view_add(list, TERRIMPI_VIEW_KIND_IMPOSTOR, (uint32_t)(p - cache->pictures));
    return 1;
}

/* Lists the impostors of a node's children; all or none of them has a picture. */
static int terrimpi_view_impostor_add_children(const terrimpi_frame *f, terrimpi_cache *cache,
                                               const terrimp_node *node,
                                               terrimpi_view_draws *list)
{
    terrimp_node children[4];
    uint32_t i, count;
    if (node->level == 0)
        return 0;
    count = terrimpi_tree_children(&f->terrain->tree, node, f->eye, children);
    for (i = 0; i < count; i++) {
        const terrimpi_cache_picture *p = terrimpi_cache_find(cache, children[i].number);
        if (!p || p->layer_count == 0 ||
            !terrimpi_tree_opens(&f->terrain->tree, children[i].number))
            return 0;
    }
    for (i = 0; i < count; i++)
        if (!terrimpi_view_impostor_add(f, cache, &children[i], list))
            return 0;
    return 1;
}

/* Lists a candidate, or in its place what shows the same: its children, of which it was put
   together, or its parents, of which it is a part; but these show more than the region, which in
   painter's order would cover what is before it. Returns 0 when there is no picture. */
static int terrimpi_candidate_list(const terrimpi_frame *f, terrimpi_cache *cache,
                                   const terrimpi_candidate *c, terrimpi_view_draws *list)
{
    const terrimp_quadtree *tree = &f->terrain->tree;
    terrimp_node node = c->node;
    uint32_t up;
    if (terrimpi_view_impostor_add(f, cache, &node, list))
        return 1;
    list->waiting++;
    if (f->desc->mode != TERRIMP_MODE_AUTO)
        return 0;
    if (terrimpi_view_impostor_add_children(f, cache, &node, list))
        return 1;
    for (up = f->desc->sorted ? 2u : 0u; up < 2u && node.level + 1u < tree->level_count; up++) {
        terrimp_box box;
        node = terrimpi_tree_parent(tree, &node);
        terrimpi_terrain_node_box(f->terrain, &node, &box);
        if (terrimpi_view_distance(f, &box) >= f->desc->fade_start &&
            terrimpi_view_impostor_add(f, cache, &node, list))
            return 1;
    }
    return 0;
}

/* Lists a region's impostors, and in the fade band its ground, over which they appear; or nothing,
   when one of them has no picture. */
static int terrimpi_view_impostor_list(const terrimpi_frame *f, terrimpi_cache *cache,
                                       const terrimpi_region *region, terrimpi_view_draws *list)
{
    float band = f->desc->fade_end - f->desc->fade_start;
    uint32_t before = list->count, i;
    int covered = 1;
    for (i = 0; i < region->candidate_count; i++)
        covered &= terrimpi_candidate_list(f, cache, &region->candidates[i], list);
    if (!covered) {
        while (list->count > before)
            cache->pictures[list->items[--list->count].index].listed = 0;
        return 0;
    }
    for (i = before; i < list->count; i++)
        list->items[i].alpha = terrimpi_min(1.0f, (region->closest - f->desc->fade_start) / band);
    return region->closest >= f->desc->fade_end ||
           terrimpi_view_ground_list(f, cache, region, list);
}

/* ---- the commands ---- */

/* Where the indices of a ground draw stand: those of the 16 patterns come first in the buffer. */
static void terrimpi_view_ground_pattern(const terrimp_view *v, uint32_t draw,
                                         terrimp_pattern *found)
{
    memset(found, 0, sizeof *found); /* an analyser cannot know that there is one */
    terrimp_pattern_find(v->terrain->desc.chunk_quads, TERRIMP_FORM_LIST,
                         v->ground.draws[draw].pattern, found);
}

static void terrimpi_view_ground_emit(const terrimp_view *v, const terrimpi_view_draw *draw,
                                      const terrimp_callbacks *callbacks)
{
    const terrimp_geomip_draw *ground = &v->ground.draws[draw->index];
    terrimp_node place;
    terrimp_ground_command command;
    terrimp_pattern pattern;
    terrimpi_view_ground_pattern(v, draw->index, &pattern);
    memset(&command, 0, sizeof command);
    place = terrimpi_real_place(v->terrain, &ground->node, v->frame.middle, command.offset);
    TERRIMPI_COMMAND_NODE(&command, place);
    command.first_index = pattern.first_index;
    command.index_count = pattern.index_count;
    command.morph = ground->morph;
    memcpy(command.side, ground->side, sizeof command.side);
    memcpy(command.side_coarse, ground->side_coarse, sizeof command.side_coarse);
    callbacks->draw_ground(callbacks->user, &command);
}

static void terrimpi_view_impostor_emit(const terrimp_view *v, const terrimpi_view_draw *draw,
                                        const terrimp_callbacks *callbacks)
{
    terrimpi_cache_picture *picture = &v->cache.pictures[draw->index];
    terrimp_node place;
    terrimp_impostor_command command;
    terrimp_mesh_info mesh;
    float eye[3];
    uint32_t k, layer;
    terrimpi_mesh_place(v->terrain, picture->node.number, &mesh);
    memset(&command, 0, sizeof command);
    place = terrimpi_real_place(v->terrain, &picture->node, v->frame.middle, command.offset);
    TERRIMPI_COMMAND_NODE(&command, place);
    command.part_count = picture->layer_count;
    command.base_vertex = mesh.base_vertex;
    command.first_index = mesh.first_index;
    command.index_count = mesh.index_count;
    command.alpha = draw->alpha;
    memcpy(command.eye, picture->eye, sizeof command.eye);
    if (v->frame.camera.orthographic)
        terrimpi_capture_origin(v->terrain, &picture->node, command.eye);
    memcpy(eye, command.eye, sizeof eye);
    command.eye[0] += v->frame.middle[0];
    command.eye[2] += v->frame.middle[1];
    picture->drawn_count++;
    for (k = 0; k < picture->layer_count; k++) {
        layer = v->desc.sorted ? picture->layer_count - 1u - k : k;
        command.part = layer;
        command.atlas = picture->slots[layer].atlas;
        memcpy(command.texture_matrix, picture->texture_matrix[layer],
               sizeof command.texture_matrix);
        if (v->cache.places) {
            memcpy(command.place_matrix, v->cache.places[draw->index].matrix[layer],
                   sizeof command.place_matrix);
            v->cache.exact->from(command.place_matrix, eye, v->frame.camera.eye);
        }
        callbacks->draw_impostor(callbacks->user, &command);
    }
}

/* Whether lines from the frame's eye to quad i of the floor come in over all ground of the sides
   that the eye is beyond: then they meet the ground before the floor. The lowest of them goes to
   the closest corner, and it is lower still if that lay at the lowest height of all. */
static int terrimpi_view_floor_shows(const terrimpi_frame *f, uint32_t beyond, uint32_t i)
{
    const terrimp_terrain *t = f->terrain;
    const terrimp_box *box = &f->all;
    const terrimp_quadtree *tree = &t->tree;
    const float *eye = f->camera.eye;
    uint32_t level = t->floor_level, quads = t->desc.chunk_quads << level, k, n;
    terrimp_rect samples = terrimpi_floor_quad(t, i);
    float at[2][3];
    int side;
    at[0][0] = terrimpi_terrain_x(t, samples.x);
    at[0][2] = terrimpi_terrain_z(t, samples.y);
    at[1][0] = terrimpi_terrain_x(t, samples.x + samples.width - 1u);
    at[1][2] = terrimpi_terrain_z(t, samples.y + samples.height - 1u);
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        int is_x = !terrimpi_along_x(side), a = is_x ? 0 : 2, b = 2 - a, is_last = side & 1;
        float border = is_last ? box->max[a] : box->min[a], from, to, in, height;
        float step = (float)quads * (is_x ? t->desc.field.spacing_z : t->desc.field.spacing_x);
        uint32_t count = is_x ? tree->level_z[level] : tree->level_x[level];
        uint32_t last = (is_x ? tree->level_x[level] : tree->level_z[level]) - 1u;
        if (!(beyond & 1u << side))
            continue;
        from = TERRIMPI_FLOAT_MAX, to = -TERRIMPI_FLOAT_MAX, height = TERRIMPI_FLOAT_MAX;
        for (k = 0; k < 4u; k++) { /* its corners: where, and how low, the lines come in */
            in = (border - eye[a]) / (at[k % 2u][a] - eye[a]);
            height = terrimpi_min(height, eye[1] + in * (box->min[1] - eye[1]));
            in = eye[b] + in * (at[k / 2u][b] - eye[b]) - box->min[b];
            from = terrimpi_min(from, in), to = terrimpi_max(to, in);
        }
        if (to < -0.001f * step || from > box->max[b] - box->min[b] + 0.001f * step)
            continue; /* they come in over another side */
        n = (uint32_t)terrimpi_clamp(from / step, 0.0f, (float)(count - 1u));
        for (; n < count && (float)n * step <= to + 0.001f * step; n++) {
            uint32_t x = is_x ? (is_last ? last : 0u) : n, z = is_x ? n : is_last ? last : 0u;
            if (height < (tree->nodes ? tree->nodes[terrimpi_tree_at(tree, level, x, z).number].high
                                      : box->max[1]))
                return 0;
        }
    }
    return 1;
}

/* Makes a command longer by a quad, or draws it and returns its triangles. */
static uint32_t terrimpi_view_floor_step(terrimp_floor_command *command, uint32_t end, int shows,
                                         const terrimp_callbacks *callbacks, uint32_t *draws)
{
    uint32_t triangles = command->index_count / 3u;
    command->index_count += shows ? 6u : 0u;
    if (shows || triangles == 0)
        return 0;
    command->first_index = end - command->index_count;
    ++*draws;
    if (callbacks)
        callbacks->draw_floor(callbacks->user, command);
    command->index_count = 0;
    return triangles;
}

/* Draws what may be seen of the floor, in runs of quads, or counts it when `callbacks` is NULL;
   returns its triangles. */
static uint32_t terrimpi_view_floor_run(const terrimp_view *v, terrimp_floor_command *command,
                                        const terrimp_callbacks *callbacks, uint32_t *draws)
{
    uint32_t quads = terrimpi_floor_of(v->built).skirt_index / 6u, i, shown = 0;
    uint32_t first = command->first_index, beyond = terrimpi_view_beside(&v->frame);
    for (i = 0; i <= quads; i++)
        shown += terrimpi_view_floor_step(
            command, first + 6u * i,
            i < quads && (!beyond || terrimpi_view_floor_shows(&v->frame, beyond, i)), callbacks,
            draws);
    return shown;
}

static void terrimpi_view_floor_command(const terrimp_view *v, terrimp_floor_command *command)
{
    memset(command, 0, sizeof *command);
    command->base_vertex = terrimpi_mesh_places(v->built) * v->terrain->vertex_stride;
    command->first_index = terrimpi_mesh_places(v->built) * v->terrain->index_stride;
}

static void terrimpi_view_floor_emit(const terrimp_view *v, const terrimpi_view_draw *draw,
                                     const terrimp_callbacks *callbacks)
{
    terrimp_floor_command command;
    uint32_t draws = 0;
    if (!callbacks->draw_floor)
        return;
    terrimpi_view_floor_command(v, &command);
    if (v->terrain->real) { /* its first chunk says of which repetition */
        uint32_t tiles = v->terrain->tiles;
        terrimp_node first = terrimpi_tree_at(&v->terrain->tree, 0, draw->index % tiles *
                                              v->built->tree.level_x[0], draw->index / tiles *
                                              v->built->tree.level_z[0]);
        terrimpi_real_place(v->terrain, &first, v->frame.middle, command.offset);
    }
    terrimpi_view_floor_run(v, &command, callbacks, &draws);
}

/* Whether the eye is over the ground behind a segment of the outer border: then the skirt goes on
   where that ends, and else it would stand in the air. */
static int terrimpi_view_skirt_shows(const terrimp_view *v, uint32_t level, uint32_t side,
                                     uint32_t segment)
{
    const terrimp_heightfield *f = &v->built->desc.field;
    const float *eye = v->frame.camera.eye;
    uint32_t along_x = terrimpi_along_x((int)side) ? 1u : 0u, step = 1u << level, k;
    uint32_t last = (along_x ? f->width : f->depth) - 1u;
    uint32_t end = (along_x ? f->depth : f->width) - 1u, at[2], across = side & 1u ? end : 0u;
    uint32_t in = side & 1u ? end - terrimpi_min_u32(step, end) : terrimpi_min_u32(step, end);
    float x = (eye[0] - f->origin_x) / f->spacing_x, z = (eye[2] - f->origin_z) / f->spacing_z;
    float along = along_x ? x : z, out = (along_x ? z : x) - (float)across, heights[2], rise;
    for (k = 0; k < 2u; k++) {
        at[k] = terrimpi_min_u32((segment + k) << level, last);
        heights[k] = terrimpi_skirt_sample(f, along_x, at[k], across);
    }
    rise = (heights[1] - heights[0]) / (float)(at[1] - at[0]);
    for (k = 0; k < 2u; k++)
        if (eye[1] > heights[0] + rise * (along - (float)at[0]) +
                         (terrimpi_skirt_sample(f, along_x, at[k], in) - heights[k]) * out /
                             ((float)in - (float)across))
            return 1;
    return 0;
}

/* Draws the skirts of coarse ground at the sides that the eye is beyond, or counts them when
   `callbacks` is NULL; returns their triangles. Ground that morphs has those of the level that is
   closer. */
static uint32_t terrimpi_view_skirts_run(const terrimp_view *v, const terrimp_callbacks *callbacks,
                                         uint32_t *draws)
{
    const terrimp_terrain *t = v->built;
    uint32_t beyond = terrimpi_view_beside(&v->frame), side, i, shown = 0, gap;
    terrimp_floor_command command;
    terrimpi_view_floor_command(v, &command);
    for (i = 0; i < v->draws.count; i++) {
        const terrimp_geomip_draw *draw = &v->ground.draws[v->draws.items[i].index];
        uint32_t level = draw->node.level + (draw->morph > 0.5f);
        if (v->draws.items[i].kind != TERRIMPI_VIEW_KIND_GROUND || level < t->skirt_level)
            continue;
        for (side = 0; side < TERRIMP_SIDE_COUNT; side++) {
            uint32_t n = terrimpi_along_x((int)side) ? draw->node.x : draw->node.z, from, to, first;
            uint32_t quads = t->desc.chunk_quads << draw->node.level;
            terrimp_node next;
            if (!(beyond & 1u << side) ||
                terrimpi_tree_beyond(&t->tree, &draw->node, (int)side, &next))
                continue;
            gap = TERRIMPI_VIEW_SKIRT_GAP;
            first = terrimpi_mesh_places(t) * t->index_stride + terrimpi_floor_of(t).skirt_index +
                    6u * terrimpi_skirt_before(t, level, side);
            to = terrimpi_min_u32(terrimpi_skirt_segments(t, level, side),
                                  ((n + 1u) * quads + (1u << level) - 1u) >> level);
            for (from = n * quads >> level; from <= to; from++) {
                gap = from == to ? TERRIMPI_VIEW_SKIRT_GAP
                      : terrimpi_view_skirt_shows(v, level, side, from) ? 0u : gap + 1u;
                shown += terrimpi_view_floor_step(&command, first + 6u * from,
                                                  gap < TERRIMPI_VIEW_SKIRT_GAP, callbacks, draws);
            }
        }
    }
    return shown;
}

static void terrimpi_view_skirts_emit(const terrimp_view *v, const terrimpi_view_draw *draw,
                                      const terrimp_callbacks *callbacks)
{
    uint32_t draws = 0;
    (void)draw;
    if (callbacks->draw_floor)
        terrimpi_view_skirts_run(v, callbacks, &draws);
}

/* What can show a region. */
typedef struct terrimpi_view_kind {
    /* What it costs; returns 0 when it cannot show the region. */
    int (*estimate)(const terrimpi_frame *f, const terrimpi_region *region,
                    terrimpi_region_offer *offer);
    /* Whether it can do so in this frame, before captures. */
    int (*ready)(const terrimpi_region *region);
    /* Puts its draws on the list; returns 0 when it is not ready: then the kind before it does. */
    int (*list)(const terrimpi_frame *f, terrimpi_cache *cache, const terrimpi_region *region,
                terrimpi_view_draws *list);
    void (*emit)(const terrimp_view *v, const terrimpi_view_draw *draw,
                 const terrimp_callbacks *callbacks);
} terrimpi_view_kind;

static const terrimpi_view_kind terrimpi_view_kinds[TERRIMPI_VIEW_KIND_COUNT] = {
    {terrimpi_view_ground_estimate, terrimpi_view_ground_ready, terrimpi_view_ground_list,
     terrimpi_view_ground_emit},
    {terrimpi_view_impostor_estimate, terrimpi_view_impostor_ready, terrimpi_view_impostor_list,
     terrimpi_view_impostor_emit},
    {NULL, NULL, NULL, terrimpi_view_floor_emit},
    {NULL, NULL, NULL, terrimpi_view_skirts_emit}
};

/* What a frame costs: its draws, and captures in the mean frame; and the pixels that are wanted of
   pictures. */
typedef struct terrimpi_frame_sums {
    float drawn, spread, pixels;
} terrimpi_frame_sums;

/* Decides what shows a region: what costs least; what did so before, unless another is cheaper by
   TERRIMPI_VIEW_FLIP. Adds it to the frame's sums. */
static void terrimpi_view_decide(const terrimpi_frame *f, const terrimpi_cache *cache,
                                 uint8_t *kind_of, terrimpi_region *region,
                                 terrimpi_frame_sums *sums)
{
    terrimpi_region_offer offers[TERRIMPI_VIEW_KIND_SHOWS];
    int possible[TERRIMPI_VIEW_KIND_SHOWS], kind, best = TERRIMPI_VIEW_KIND_GROUND;
    int before = kind_of[region->node];
    float total[TERRIMPI_VIEW_KIND_SHOWS];
    uint32_t i;
    int is_known = !region->kind;
    terrimpi_region_measure(f, cache, region);
    for (kind = 0; kind < TERRIMPI_VIEW_KIND_SHOWS; kind++) {
        possible[kind] = terrimpi_view_kinds[kind].estimate(f, region, &offers[kind]);
        total[kind] = offers[kind].draw + offers[kind].upkeep;
        if (possible[kind] && total[kind] < total[best])
            best = kind;
    }
    if (possible[before] && total[before] < total[best] * TERRIMPI_VIEW_FLIP)
        best = before;
    if (possible[TERRIMPI_VIEW_KIND_IMPOSTOR] && f->desc->mode == TERRIMP_MODE_IMPOSTOR)
        best = TERRIMPI_VIEW_KIND_IMPOSTOR;
    region->kind = (uint8_t)best;
    for (i = 0; i < region->candidate_count; i++)
        is_known &= region->candidates[i].is_known &&
                    !region->candidates[i].is_short;
    if (is_known) /* else a page that comes later must not find it settled */
        kind_of[region->node] = (uint8_t)best;
    sums->spread += offers[best].upkeep;
    sums->drawn += offers[terrimpi_view_kinds[best].ready(region) ? best : 0].draw;
    for (i = 0; i < region->candidate_count && best == TERRIMPI_VIEW_KIND_IMPOSTOR; i++) {
        const terrimpi_candidate *c = &region->candidates[i];
        sums->pixels += c->pixels;
        if (c->picture)
            c->picture->seen = f->number;
    }
}

/* The texels a pixel that the next frame's pictures get: what the atlases have room for. */
static float terrimpi_view_density(const terrimp_view_desc *d, float pixels)
{
    float side = (float)d->atlas_size;
    float room = TERRIMPI_VIEW_FILL * side * side * (float)d->atlas_count;
    return terrimpi_clamp(TERRIMP_SQRTF(room / terrimpi_max(pixels, 1.0f)),
                          TERRIMPI_VIEW_SOFTEST * d->texels_per_px, d->texels_per_px);
}

/* ---- the schedule of captures ---- */

/* Whether the picture of a node is better made in two layers, and where: when smears of what hides
   behind its ridges would show before it is renewed, and a split spares most of them. The node's
   mesh is in xyz. */
static int terrimpi_view_split(const terrimpi_frame *f, const terrimpi_capture_plan *plan,
                               float closest, const float *xyz, const uint16_t *indices,
                               float *distance)
{
#ifndef TERRIMP_NO_SPLIT
    const terrimpi_mesh *mesh = terrimpi_mesh_of(f->terrain, plan->node.number);
    float sine = terrimpi_view_sine(f, plan->node.number, closest);
    float overlap = terrimpi_capture_overlap(f->terrain, plan);
    terrimp_split split;
    if (f->desc->no_splits || f->camera.orthographic || f->desc->mode != TERRIMP_MODE_AUTO ||
        !(sine * closest > 0.0f) ||
        2.0f * overlap >
            TERRIMPI_VIEW_SPLIT_OVERLAP * (plan->camera.z_far - plan->camera.z_near))
        return 0;
    terrimpi_impostor_split(&plan->camera, xyz, terrimpi_mesh_vertices(mesh), indices,
                            3u * terrimpi_mesh_triangles(mesh), sine * closest, overlap, &split);
    *distance = split.distance;
    return split.gap * sine * f->pixel_factor >
               TERRIMPI_VIEW_SPLIT_SMEAR * f->desc->tolerance_px &&
           split.gap_left < split.gap * TERRIMPI_VIEW_SPLIT_GAIN;
#else
    (void)f, (void)plan, (void)closest, (void)xyz, (void)indices, (void)distance;
    return 0;
#endif
}

/* Whether all pages are here that a capture draws; those that are not are wanted: that is late. */
static int terrimpi_capture_has_pages(const terrimp_quadtree *t, const terrimpi_capture_draw *draws,
                                      uint32_t count, float urgency, uint32_t *late)
{
    int reason = urgency < 1.0f ? TERRIMP_WANT_AHEAD : TERRIMP_WANT_PICTURE, all = 1;
    uint32_t i;
    for (i = 0; i < count && t->pages; i++)
        all &= t->pages->calls->want(t, draws[i].node, reason, terrimpi_min(urgency, 2.0f));
    *late += all ? 0u : 1u;
    return all;
}

/* Finds slots for a job: those of the old picture, unless the new one is made in pieces and the old
   one is drawn meanwhile. */
static int terrimpi_job_slots(terrimpi_cache *cache, const uint32_t size[2], terrimpi_job *job)
{
    const terrimpi_cache_picture *picture = job->picture;
    if (!job->in_pieces && terrimpi_cache_suits(cache, picture, size, job->plan.layer_count)) {
        memcpy(job->slots, picture->slots, sizeof job->slots);
        return 1;
    }
    return terrimpi_cache_slots(cache, size, job->slots, job->plan.layer_count);
}

/* How many triangles of a capture are worth `room` triangles: with max_cost the share of each in
   its other costs counts, too. */
static uint32_t terrimpi_spending_room(const terrimpi_frame *f, uint32_t room,
                                       const terrimpi_job *job)
{
    float share = f->desc->costs.triangle * (float)job->triangles / job->cost;
    return f->desc->max_cost > 0.0f && share < 1.0f ? (uint32_t)((float)room * share) : room;
}

/* Puts a capture together: camera, source, border; then finds it slots. When it needs more than
   `room` triangles it may be cut, if no other one is; 0: it only asks for its pages. Returns 0 when
   it cannot be made. */
static int terrimpi_job_prepare(terrimp_view *v, const terrimpi_candidate *c, uint32_t room,
                                terrimpi_job *job)
{
    const terrimpi_frame *f = &v->frame;
    const terrimp_costs *costs = &f->desc->costs;
    terrimpi_capture_plan *plan = &job->plan;
    float origin[3], forward[3], distance, split = 0.0f;
    int parallel = f->camera.orthographic;
    float apart = terrimpi_view_apart(f, &c->node, c->closest);
    float texels = 1.5f + apart * f->density; /* bilinear, and what comes into sight */
    uint32_t size[2], i, count, largest = f->desc->max_slot - 2u * TERRIMPI_CAPTURE_MARGIN;
    terrimp_mesh_info mesh;
    int is_known;
    memset(job, 0, sizeof *job);
    if (c->is_short) { /* it wants the nodes that it stands for */
        terrimpi_page_need need = {&f->frustum, f->eye, TERRIMP_WANT_PICTURE, 4.0f, 0.0f};
        f->terrain->tree.pages->calls->divides(f->terrain, &c->node, &need);
        v->late++;
        return 0;
    }
    job->picture = terrimpi_cache_find(&v->cache, c->node.number);
    if (job->picture && terrimpi_cache_refuses(&v->cache, f->still, job->picture))
        return 0;
    plan->node = c->node;
    plan->layer_count = 1;
    plan->limit = f->desc->cost_limit;
    terrimpi_terrain_node_box(f->terrain, &c->node, &plan->box);
    terrimpi_view_ahead(f, &c->node, &plan->box, c->closest, plan->eye);
    memcpy(origin, plan->eye, sizeof origin);
    if (parallel) {
        terrimpi_capture_origin(f->terrain, &c->node, origin);
        terrimpi_view_along(f, plan->eye, forward);
    }
    terrimpi_mesh_place(f->terrain, c->node.number, &mesh);
    terrimpi_mesh_write(f->terrain, c->node.number, v->room.xyz, v->room.indices);
    if (!terrimpi_capture_aim(&plan->box, origin, parallel ? forward : NULL, v->room.xyz,
                              mesh.vertex_count, f->side_px * f->density, largest,
                              &plan->camera, size) ||
        !terrimpi_view_has_slot(f, &plan->camera))
        return 0;
    distance = terrimp_box_distance(&plan->box, plan->eye);
    plan->source = terrimpi_view_source(f, &c->node, distance, &is_known);
    plan->border = terrimpi_capture_border(f->terrain, plan, size, texels);
    count = terrimpi_capture_list(f->terrain, plan, v->room.draws);
    if (!terrimpi_capture_has_pages(&v->terrain->tree, v->room.draws, count, c->urgency,
                                    &v->late) || room == 0)
        return 0;
    if (!job->picture)
        job->picture = terrimpi_cache_take(&v->cache, &c->node);
    if (!job->picture)
        return 0;
    job->triangles = terrimpi_capture_triangles(f->terrain, plan, v->room.draws, count);
    job->cost = terrimpi_cost_capture(costs, (float)size[0] * (float)size[1],
                                      (float)job->triangles);
    room = terrimpi_spending_room(f, room, job);
    job->in_pieces = f->desc->max_capture_triangles || (job->triangles > room && !v->jobs.open);
    if (!job->in_pieces && job->triangles <= room / 2u &&
        terrimpi_view_split(f, plan, c->closest, v->room.xyz, v->room.indices, &split))
        plan->layer_count = TERRIMPI_CAPTURE_LAYERS;
    if (!terrimpi_job_slots(&v->cache, size, job)) {
        job->picture->refused = f->number;
        return 0;
    }
    size[0] = terrimpi_cache_rect(&v->cache, &job->slots[0]).width;
    size[1] = terrimpi_cache_rect(&v->cache, &job->slots[0]).height;
    terrimpi_capture_spread(f->terrain, plan, size, texels);
    if (plan->layer_count > 1u)
        terrimpi_capture_divide(f->terrain, plan, split);
    count = terrimpi_capture_list(f->terrain, plan, v->room.draws);
    job->to = job->end = count * terrimpi_capture_rows(f->terrain);
    job->triangles = terrimpi_capture_triangles(f->terrain, plan, v->room.draws, count);
    job->sharpness = terrimpi_view_sharpness(f, distance);
    memcpy(job->light, f->light, sizeof job->light);
    job->cost = costs->triangle * (float)job->triangles;
    for (i = 0; i < plan->layer_count; i++) {
        terrimp_rect rect = terrimpi_cache_rect(&v->cache, &job->slots[i]);
        job->texels += rect.width * rect.height;
        job->cost += terrimpi_cost_capture(costs, (float)rect.width * (float)rect.height, 0.0f);
    }
    return 1;
}

/* Takes what of a picture still fits into a number of triangles: one draw at least; with max_cost
   one row of a whole node. Returns how many triangles that are. */
static uint32_t terrimpi_job_cut(const terrimp_view *v, uint32_t triangles, terrimpi_job *job)
{
    uint32_t rows = terrimpi_capture_rows(v->terrain), used = 0;
    for (job->to = job->from; job->to < job->end;) {
        const terrimpi_capture_draw *draw = &v->room.draws[job->to / rows];
        uint32_t count = rows - job->to % rows;
        if (used + draw->triangle_count * count / rows > triangles) {
            if (v->desc.max_cost > 0.0f && job->plan.limit && draw->first_index == 0)
                count = (terrimpi_max_u32(triangles, used) - used) * rows / draw->triangle_count;
            else if (used > 0)
                break;
            if (count == 0 && used > 0)
                break;
            count = terrimpi_max_u32(count, 1u);
        }
        job->to += count;
        used += draw->triangle_count * count / rows;
    }
    return used;
}

/* Whether a candidate is to be captured after another: what is missing comes first, then what is
   due, then what soon will be; among equals the lower node. */
static int terrimpi_candidate_after(const void *candidates, uint32_t a, uint32_t b)
{
    const terrimpi_candidate *c = (const terrimpi_candidate *)candidates;
    if (c[a].rank != c[b].rank)
        return c[a].rank < c[b].rank;
    if (c[a].weight > c[b].weight || c[a].weight < c[b].weight)
        return c[a].weight < c[b].weight;
    return c[a].node.number > c[b].node.number;
}

/* Lists what could be captured, most urgent first; each rank by the error on the screen times the
   pixels that show it. Returns how many. */
static uint32_t terrimpi_regions_queue(const terrimpi_frame *f, const terrimpi_job *begun,
                                       terrimpi_regions *regions)
{
    uint32_t i, count = 0;
    const terrimpi_region *r;
    for (r = regions->items; r < regions->items + regions->count; r++)
        for (i = 0; i < r->candidate_count; i++) {
            terrimpi_candidate *c = &r->candidates[i];
            float weight = terrimpi_max(c->pixels / (1.0f + c->pixels), 1e-3f) + c->pixels;
            if (r->kind != TERRIMPI_VIEW_KIND_IMPOSTOR ||
                (begun && begun->plan.node.number == c->node.number) ||
                (c->urgency < 1.0f && !c->is_short && /* that one only asks for pages */
                 (f->desc->no_spreading || c->urgency < TERRIMPI_VIEW_EARLY)))
                continue;
            c->rank = !terrimpi_candidate_ready(c) ? TERRIMPI_JOB_RANK_MISSING
                      : c->urgency >= 1.0f         ? TERRIMPI_JOB_RANK_DUE
                                                   : TERRIMPI_JOB_RANK_EARLY;
            c->weight = c->rank == TERRIMPI_JOB_RANK_MISSING
                            ? weight
                            : weight * terrimpi_max(terrimpi_min(c->urgency, 2.0f),
                                                    terrimpi_view_age(f, c->picture));
            regions->queue[count++] = (uint32_t)(c - regions->candidates);
        }
    terrimpi_sort(regions->queue, count, regions->candidates, terrimpi_candidate_after);
    return count;
}

/* What the captures of a frame may cost, and what those that are taken do. */
typedef struct terrimpi_spending {
    float allowance, spread, cost;
    uint32_t texels, triangles;
} terrimpi_spending;

/* Triangles of a whole source node, with max_cost of an eighth: no piece of a picture is worth
   less. */
static uint32_t terrimpi_spending_least(const terrimpi_frame *f)
{
    uint32_t quads = f->terrain->desc.chunk_quads;
    return f->desc->max_cost > 0.0f ? quads * quads / 4u : 2u * quads * quads;
}

/* How many triangles the next capture may draw. What is more is left to the next frames. */
static uint32_t terrimpi_spending_left(const terrimpi_frame *f, const terrimpi_spending *s)
{
    uint32_t hard = f->desc->max_capture_triangles, left = 0xffffffffu;
    if (!f->desc->no_spreading) {
        float room = (s->allowance - s->cost) / f->desc->costs.triangle;
        left = (uint32_t)terrimpi_clamp(room, 0.0f, 1e9f);
        if (s->cost == 0.0f)
            left = terrimpi_max_u32(left, terrimpi_spending_least(f));
    }
    if (hard)
        left = terrimpi_min_u32(left, hard - terrimpi_min_u32(hard, s->triangles));
    return left;
}

/* Adds a job, or a piece of one, of so many triangles. A picture that will be complete is judged
   anew: it is drawn in this frame. */
static void terrimpi_spending_add(const terrimpi_frame *f, const terrimpi_job *job,
                                  uint32_t triangles, terrimpi_spending *s)
{
    terrimpi_cache_picture *p = job->picture;
    s->texels += job->texels;
    s->triangles += triangles;
    s->cost += job->cost * (float)triangles / (float)terrimpi_max_u32(job->triangles, 1u);
    if (job->to < job->end)
        return;
    p->judged = f->number;
    p->layers_now = (uint8_t)job->plan.layer_count;
    p->urgency = terrimpi_view_error(f, &p->node, job->plan.eye, &p->angle_rad, &p->parallax_px);
}

/* Takes the capture of a candidate as the next job, whole or its first piece, if the limits allow.
   Returns 0 when it is put off. */
static int terrimpi_view_take(terrimp_view *v, const terrimpi_candidate *c, terrimpi_spending *s)
{
    const terrimp_view_desc *d = &v->desc;
    terrimpi_job *job = &v->jobs.items[v->jobs.count], none;
    uint32_t room = terrimpi_spending_left(&v->frame, s), triangles;
    if (v->jobs.count == d->max_captures ||
        (s->cost > 0.0f && room < terrimpi_spending_least(&v->frame)) ||
        (c->urgency < 1.0f && s->cost + c->capture_cost > s->spread) ||
        (d->max_cost > 0.0f && s->cost > 0.0f && s->cost + c->capture_cost > s->allowance) ||
        (d->max_capture_texels && s->texels >= d->max_capture_texels)) {
        if (v->terrain->tree.pages && (c->urgency >= 1.0f || c->is_short))
            terrimpi_job_prepare(v, c, 0, &none); /* so its pages come meanwhile, and stay */
        return 0;
    }
    if (!terrimpi_job_prepare(v, c, room, job))
        return 0;
    room = terrimpi_spending_room(&v->frame, room, job);
    if ((d->max_capture_texels && s->texels > 0 &&
         s->texels + job->texels > d->max_capture_texels) ||
        (job->triangles > room && v->jobs.open)) {
        terrimpi_job_cancel(&v->cache, job);
        return 0;
    }
    v->jobs.count++;
    triangles = job->triangles;
    if (triangles > room && job->in_pieces) {
        triangles = terrimpi_job_cut(v, room, job);
        v->jobs.open = job->to < job->end ? v->jobs.count : 0u;
    }
    terrimpi_spending_add(&v->frame, job, triangles, s);
    return 1;
}

/* Makes the next piece of the picture that has been begun, unless it has become useless. */
static void terrimpi_view_continue(terrimp_view *v, terrimpi_spending *s)
{
    terrimpi_job *job = &v->jobs.items[0];
    float angle, parallax;
    uint32_t count, room;
    int has_pages;
    count = terrimpi_capture_list(v->terrain, &job->plan, v->room.draws);
    has_pages = terrimpi_tree_opens(&v->terrain->tree, job->plan.node.number) &&
                terrimpi_capture_has_pages(&v->terrain->tree, v->room.draws, count, 2.0f,
                                           &v->late);
    if (!has_pages ||
        terrimpi_view_error(&v->frame, &job->plan.node, job->plan.eye, &angle, &parallax) >=
        TERRIMPI_VIEW_STALE) {
        terrimpi_job_cancel(&v->cache, job);
        v->jobs.open = 0;
        return;
    }
    v->jobs.count = 1;
    job->picture->seen = v->frame.number;
    room = terrimpi_spending_room(&v->frame, terrimpi_spending_left(&v->frame, s), job);
    terrimpi_spending_add(&v->frame, job, terrimpi_job_cut(v, room, job), s);
}

/* Continues the picture that is being made in pieces; then takes captures from the queue as the
   limits allow. `spread` is what captures cost in the mean frame, `drawn` what the draws of this
   frame cost: together with captures for as much as that, no frame is much worse than the last. */
static void terrimpi_view_schedule(terrimp_view *v, float spread, float drawn)
{
    terrimpi_spending s;
    uint32_t i, count, put_off = 0, due = 0;
    memset(&s, 0, sizeof s);
    s.allowance = terrimpi_max(TERRIMPI_VIEW_SPREAD * spread, drawn);
    if (v->desc.max_cost > 0.0f)
        s.allowance = terrimpi_clamp(v->desc.max_cost - drawn, 0.0f, s.allowance);
    s.spread = spread;
    if (v->jobs.open)
        terrimpi_view_continue(v, &s);
    count = terrimpi_regions_queue(&v->frame, v->jobs.open ? v->jobs.items : NULL, &v->regions);
    for (i = 0; i < count; i++) {
        const terrimpi_candidate *c = &v->regions.candidates[v->regions.queue[i]];
        int is_due = c->urgency >= 1.0f;
        int taken = terrimpi_view_take(v, c, &s);
        due += is_due ? 1u : 0u;
        put_off += is_due && !taken ? 1u : 0u;
    }
    for (i = 0; i < v->jobs.count; i++) {
        v->stats.captures += v->jobs.items[i].plan.layer_count;
        v->stats.splits += v->jobs.items[i].plan.layer_count - 1u;
    }
    v->stats.cost = drawn + s.cost;
    v->stats.captured_texels = s.texels;
    v->stats.captured_triangles = s.triangles;
    v->stats.captures_due = due;
    v->stats.hidden = v->cull.hidden_count;
    v->stats.late = v->late;
    v->stats.shortfall = due ? (float)put_off / (float)due : 0.0f;
}

/* ---- a frame ---- */

/* Lists what each region is drawn as, now that it is known which pictures will exist. */
static void terrimpi_view_list(const terrimpi_frame *f, terrimpi_cache *cache,
                               const terrimpi_regions *regions, terrimpi_view_draws *list)
{
    uint32_t i, tiles = f->terrain->real ? f->terrain->tiles : 1u;
    memset(list->kind_count, 0, sizeof list->kind_count);
    list->count = list->waiting = 0;
    for (i = 0; i < regions->count; i++) {
        int kind = regions->items[i].kind;
        while (!terrimpi_view_kinds[kind].list(f, cache, &regions->items[i], list))
            kind--;
    }
    for (i = 0; i < list->count; i++)
        list->kind_count[list->items[i].kind]++;
    if (terrimpi_view_beside(f))
        terrimpi_view_add(list, TERRIMPI_VIEW_KIND_SKIRTS, 0);
    if ((list->kind_count[TERRIMPI_VIEW_KIND_IMPOSTOR] > 0 ||
         (f->desc->joined && f->desc->mode != TERRIMP_MODE_FULL)) &&
        (terrimpi_view_over(f, f->camera.eye) ||
         (f->desc->max_angle_rad > TERRIMPI_VIEW_BESIDE && !(f->camera.reach > 0.0f) &&
          terrimpi_view_beside(f))))
        for (i = 0; i < tiles * tiles; i++)
            terrimpi_view_add(list, TERRIMPI_VIEW_KIND_FLOOR, i);
}

/* The next frame for a camera. It follows the eye's motion; a jump is none. */
static terrimpi_frame terrimpi_frame_next(const terrimpi_frame *before,
                                          const terrimp_camera *camera)
{
    terrimpi_frame f = *before;
    terrimp_node root = terrimpi_tree_root(&f.terrain->tree);
    float step[3];
    uint32_t i;
    f.number++;
    f.still = memcmp(camera, &before->camera, sizeof *camera) == 0;
    f.camera = *camera;
    terrimpi_camera_frustum(camera, &f.frustum);
    terrimpi_terrain_node_box(f.terrain, &root, &f.all);
    f.pixel_factor = terrimpi_camera_stand(camera, &f.all, f.eye);
    f.side_px = terrimpi_camera_pixel_factor(camera);
    f.light_speed += (f.light_step - f.light_speed) / 16.0f;
    f.light_step = 0.0f;
    if (f.number == 1u) {
        terrimpi_motion_begin(&f.motion);
        return f;
    }
    for (i = 0; i < 3u; i++)
        step[i] = f.eye[i] - before->eye[i];
    terrimpi_motion_step(&f.motion, step,
                         TERRIMPI_VIEW_JUMP * (camera->orthographic ? f.pixel_factor / f.side_px
                                                                    : f.desc->fade_start));
    return f;
}

/* Finds what is in sight and what shows it: at the tolerance of the frame before, or a finer one if
   that is predicted to fit max_ground and max_cost; coarser by steps until it does. Steps that go
   on grow, so that a turn towards far more than was in sight is not dearer for many frames. */
static terrimp_result terrimpi_view_fit(terrimp_view *v, const terrimpi_frame *f,
                                        terrimpi_frame_sums *sums)
{
    float max_cost = terrimpi_view_full(&v->desc) ? 0.0f : v->desc.max_cost;
    float most = TERRIMPI_VIEW_COARSEST / v->desc.ground_tolerance_px, scale = v->ground_scale;
    float finer = max_cost > 0.0f ? TERRIMP_SQRTF(v->cost / max_cost) : TERRIMPI_VIEW_FINER;
    float step = TERRIMPI_VIEW_DEARER;
    uint32_t tries, i;
    if (finer <= TERRIMPI_VIEW_FINER)
        v->ground_scale = terrimpi_max(1.0f, scale * terrimpi_max(finer, TERRIMPI_VIEW_FINEST));
    for (tries = 0;; tries++) {
        TERRIMPI_TRY(terrimpi_view_cut(v, f));
        if (!f->camera.orthographic != !v->frame.camera.orthographic)
            terrimp_view_invalidate(v); /* no picture is of use to a camera of the other kind */
        v->frame = *f;
        memset(sums, 0, sizeof *sums);
        for (i = 0; i < v->regions.count; i++)
            terrimpi_view_decide(f, &v->cache, v->kind_of, &v->regions.items[i], sums);
        v->cost = sums->drawn + terrimpi_min(sums->spread, TERRIMPI_VIEW_RESERVE * max_cost);
        if (!(v->cost > max_cost) || !(max_cost > 0.0f) || v->ground_scale >= most ||
            tries == TERRIMPI_VIEW_TRIES)
            return TERRIMP_OK;
        finer = v->ground_scale;
        step *= tries < TERRIMPI_VIEW_EVEN ? 1.0f : TERRIMPI_VIEW_DEARER;
        v->ground_scale *= step;
        if (finer < scale)
            v->ground_scale = terrimpi_min(v->ground_scale, scale);
    }
}

TERRIMP_API terrimp_result terrimp_view_update(terrimp_view *view, const terrimp_camera *camera)
{
    terrimp_camera resolved;
    terrimpi_frame frame;
    terrimpi_frame_sums sums;
    const struct terrimp_pages *pages;
    float reuse, middle[2] = {0.0f, 0.0f};
    TERRIMPI_REFUSE(!view, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &resolved));
    if (view->tiled)
        view->desc.endless->enter(view, &resolved, middle);
    frame = terrimpi_frame_next(&view->frame, &resolved);
    memcpy(frame.middle, middle, sizeof middle);
    pages = view->terrain->tree.pages;
    if (pages)
        pages->calls->begin(&view->terrain->tree);
    TERRIMPI_TRY(terrimpi_view_fit(view, &frame, &sums));
    view->cache.frame = frame.number;
    view->outdated = 0;
    terrimpi_jobs_cancel(&view->cache, &view->jobs);
    reuse = view->stats.reuse; /* goes on */
    memset(&view->stats, 0, sizeof view->stats);
    view->stats.reuse = reuse;
    if (!terrimpi_view_full(&view->desc))
        view->stats.ground_tolerance_px = terrimpi_min(
            view->ground.tolerance_px * view->ground_scale, TERRIMPI_VIEW_COARSEST);
    terrimpi_view_schedule(view, sums.spread, sums.drawn);
    terrimpi_view_list(&view->frame, &view->cache, &view->regions, &view->draws);
    view->frame.density = terrimpi_view_density(&view->desc, sums.pixels);
    return TERRIMP_OK;
}

/* Notes that a picture has been made, and for how many frames the one before was drawn. */
static void terrimpi_view_finish(const terrimpi_frame *f, terrimpi_cache *cache,
                                 const terrimpi_job *job, float *reuse)
{
    terrimpi_cache_picture *p = job->picture;
    uint32_t i, side = f->desc->atlas_size;
    if (p->layer_count > 0) {
        *reuse += ((float)p->drawn_count - *reuse) * (*reuse > 0.0f ? 0.02f : 1.0f);
        if (memcmp(job->slots, p->slots, sizeof p->slots) != 0)
            terrimpi_cache_free(cache, p->slots, p->layer_count);
    }
    p->layer_count = (uint8_t)job->plan.layer_count;
    memcpy(p->slots, job->slots, sizeof p->slots);
    p->drawn_count = 0;
    p->sharpness = job->sharpness;
    p->cost = job->cost;
    p->expired = job->expired;
    memcpy(p->light, job->light, sizeof p->light);
    memcpy(p->eye, job->plan.eye, sizeof p->eye);
    for (i = 0; i < p->layer_count; i++) {
        terrimp_capture camera = terrimpi_capture_layer(&job->plan, i);
        terrimp_rect rect = terrimpi_cache_rect(cache, &p->slots[i]);
        if (f->camera.rows_from_top) {
            camera.tan_up = job->plan.camera.tan_down;
            camera.tan_down = job->plan.camera.tan_up;
        }
        terrimpi_impostor_texture_matrix(&camera, &rect, side, side, p->texture_matrix[i]);
        camera.z_far = terrimpi_capture_end(&job->plan, i); /* what it shows, not what wears it */
        if (cache->places)
            cache->exact->make(&camera, &rect, side, side,
                               cache->places[p - cache->pictures].matrix[i]);
    }
}

/* Makes a picture, or a piece of one. */
static void terrimpi_view_capture(terrimp_view *v, terrimpi_job *job,
                                  const terrimp_callbacks *callbacks)
{
    terrimp_capture_command command;
    uint32_t layer;
    terrimpi_capture_list(v->terrain, &job->plan, v->room.draws);
    for (layer = 0; layer < job->plan.layer_count; layer++) {
        memset(&command, 0, sizeof command);
        command.atlas = job->slots[layer].atlas;
        command.slot = terrimpi_cache_rect(&v->cache, &job->slots[layer]);
        command.clear = job->from == 0;
        command.complete = job->to == job->end;
        terrimpi_capture_emit(v->terrain, &job->plan, v->room.draws, job->from, job->to, layer,
                              v->frame.middle, &command, v->frame.camera.depth_zero_to_one,
                              callbacks);
    }
    job->from = job->to;
    if (job->to < job->end)
        return;
    terrimpi_view_finish(&v->frame, &v->cache, job, &v->stats.reuse);
    if (v->jobs.open && &v->jobs.items[v->jobs.open - 1u] == job)
        v->jobs.open = 0;
}

TERRIMP_API terrimp_result terrimp_view_render(terrimp_view *view,
                                               const terrimp_callbacks *callbacks)
{
    uint32_t i;
    int kind;
    TERRIMPI_REFUSE(!view || !callbacks, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(view->frame.number == 0 || view->outdated, TERRIMP_E_STATE);
    if ((view->draws.kind_count[TERRIMPI_VIEW_KIND_GROUND] + view->jobs.count > 0 &&
         !callbacks->draw_ground) ||
        (view->draws.kind_count[TERRIMPI_VIEW_KIND_IMPOSTOR] > 0 && !callbacks->draw_impostor) ||
        (view->jobs.count > 0 && (!callbacks->begin_capture || !callbacks->end_capture)))
        return TERRIMP_E_NULL;
    view->capturing = 1;
    for (i = 0; i < view->jobs.count; i++)
        terrimpi_view_capture(view, &view->jobs.items[i], callbacks);
    view->jobs.count = 0;
    if (view->lost) { /* it is listed anew, without the pictures that could not be made */
        for (i = 0; i < view->draws.count; i++)
            if (view->draws.items[i].kind == TERRIMPI_VIEW_KIND_IMPOSTOR)
                view->cache.pictures[view->draws.items[i].index].listed = 0;
        terrimpi_jobs_lose(&view->cache, &view->jobs);
        terrimpi_view_list(&view->frame, &view->cache, &view->regions, &view->draws);
    }
    view->capturing = view->lost = 0;
    for (i = view->desc.sorted ? view->draws.count : 0u; i-- > 0;)
        terrimpi_view_kinds[view->draws.items[i].kind].emit(view, &view->draws.items[i], callbacks);
    for (kind = 0; kind < TERRIMPI_VIEW_KIND_COUNT && !view->desc.sorted; kind++)
        for (i = 0; i < view->draws.count; i++)
            if (view->draws.items[i].kind == kind)
                terrimpi_view_kinds[kind].emit(view, &view->draws.items[i], callbacks);
    return TERRIMP_OK;
}

/* What a draw adds to the statistics. */
static void terrimpi_view_count_draw(const terrimp_view *v, const terrimpi_view_draw *draw,
                                     terrimp_stats *s)
{
    if (draw->kind == TERRIMPI_VIEW_KIND_GROUND) {
        terrimp_pattern pattern;
        terrimpi_view_ground_pattern(v, draw->index, &pattern);
        s->draws++;
        s->triangles += pattern.triangle_count;
    } else if (draw->kind == TERRIMPI_VIEW_KIND_IMPOSTOR) {
        const terrimpi_cache_picture *p = &v->cache.pictures[draw->index];
        terrimp_mesh_info mesh;
        terrimpi_mesh_place(v->terrain, p->node.number, &mesh);
        s->impostors_by_level[p->node.level]++;
        s->draws += p->layers_now;
        s->triangles += mesh.index_count / 3u * p->layers_now;
        s->worst_angle_rad = terrimpi_max(s->worst_angle_rad, p->angle_rad);
        s->worst_parallax_px = terrimpi_max(s->worst_parallax_px, p->parallax_px);
    } else {
        terrimp_floor_command none;
        memset(&none, 0, sizeof none);
        s->triangles += draw->kind == TERRIMPI_VIEW_KIND_SKIRTS
                            ? terrimpi_view_skirts_run(v, NULL, &s->draws)
                            : terrimpi_view_floor_run(v, &none, NULL, &s->draws);
    }
}

/* The statistics that the frame itself has no use for. */
static void terrimpi_view_count_frame(const terrimp_view *v, terrimp_stats *s)
{
    const terrimp_camera *c = &v->frame.camera;
    float tan_x, tan_y, first, last;
    uint32_t i;
    for (i = 0; i < v->draws.count; i++)
        terrimpi_view_count_draw(v, &v->draws.items[i], s);
    s->ground = v->draws.kind_count[TERRIMPI_VIEW_KIND_GROUND];
    s->impostors = v->draws.kind_count[TERRIMPI_VIEW_KIND_IMPOSTOR];
    s->visible = v->regions.count;
    s->waiting = v->draws.waiting;
    s->evictions = v->cache.evictions;
    s->atlas_failures = v->cache.failures;
    for (i = 0; i < v->regions.count; i++) {
        terrimp_node node = terrimpi_tree_node(&v->terrain->tree, v->regions.items[i].node);
        terrimp_box box;
        terrimpi_terrain_node_box(v->terrain, &node, &box);
        first = v->regions.items[i].closest;
        last = terrimp_box_farthest(&box, c->eye);
        if (c->orthographic) {
            terrimpi_camera_depths(&box, c->eye, c->forward, &first, &last);
            first -= c->reach;
        }
        s->z_near = i == 0 ? first : terrimpi_min(s->z_near, first);
        s->z_far = i == 0 ? last + c->reach : terrimpi_max(s->z_far, last + c->reach);
    }
    /* A point at that distance in the corner of the screen has the smallest depth. */
    terrimpi_camera_tangents(c, &tan_x, &tan_y);
    if (!c->orthographic)
        s->z_near /= TERRIMP_SQRTF(1.0f + tan_x * tan_x + tan_y * tan_y);
    for (i = 0; i < v->desc.atlas_count; i++)
        s->texels_used += v->cache.atlases[i].texels_used;
    s->texels_free = (uint64_t)v->desc.atlas_count * v->desc.atlas_size * v->desc.atlas_size -
                     s->texels_used;
}

TERRIMP_API terrimp_result terrimp_view_get_stats(const terrimp_view *view, terrimp_stats *stats)
{
    TERRIMPI_REFUSE(!view || !stats, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(view->frame.number == 0 || view->outdated, TERRIMP_E_STATE);
    *stats = view->stats;
    terrimpi_view_count_frame(view, stats);
    return TERRIMP_OK;
}

TERRIMP_API float terrimp_view_pace(float cost, float ms, float target_ms)
{
    float next = cost * terrimpi_clamp(target_ms / ms, 0.95f, 1.02f);
    if (!terrimpi_finite2(ms, target_ms) || !terrimpi_finite2(cost, next) || !(ms > 0.0f) ||
        !(target_ms > 0.0f) || !(cost > 0.0f) ||
        terrimpi_within(ms, 0.97f * target_ms, 1.03f * target_ms))
        return cost;
    return next;
}

#ifndef TERRIMP_NO_MALLOC

TERRIMP_API terrimp_result terrimp_view_create(const terrimp_terrain *terrain,
                                               const terrimp_view_desc *desc,
                                               const terrimp_allocator *allocator,
                                               terrimp_view **view)
{
    terrimp_allocator from;
    terrimp_view_desc resolved;
    terrimp_view *made = NULL;
    terrimp_result result;
    size_t bytes;
    void *memory;
    TERRIMPI_REFUSE(!view || !terrimpi_terrain_allocator(allocator, &from), TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_view_desc_resolve(terrain, desc, &resolved));
    bytes = terrimp_view_bytes(terrain, &resolved);
    TERRIMPI_REFUSE(bytes == 0, TERRIMP_E_OVERFLOW);
    memory = from.allocate(from.user, bytes);
    TERRIMPI_REFUSE(!memory, TERRIMP_E_MEMORY);
    result = terrimp_view_init(terrain, &resolved, memory, bytes, &made);
    if (result != TERRIMP_OK) {
        from.release(from.user, memory, bytes);
        return result;
    }
    made->allocator = from;
    made->bytes = bytes;
    *view = made;
    return TERRIMP_OK;
}

TERRIMP_API void terrimp_view_destroy(terrimp_view *view)
{
    if (view && view->allocator.release) {
        terrimp_allocator allocator = view->allocator;
        allocator.release(allocator.user, view, view->bytes);
    }
}

#endif /* TERRIMP_NO_MALLOC */

/* ==== Sorted ============================================================= >>impl-sorted */

/* Based on: Finch and Bishop 1998.

   Order. Rows of pages, the pages of a row, the quarters of a square, its two halves and the
   triangles of a half are each told apart by vertical planes, and of two things on different sides
   of a plane only the one on the eye's side can hide the other: whatever meets the plane's other
   side first has passed the eye's. So all that is needed is to draw, at each such cut, the side
   first that the eye is not on; and rows and columns from both ends towards the eye's. (The paper
   draws a strip from one end to the other, through the eye's column: that is no painter's order.)

   Levels. A square of level l is split when its closest point, in plan, is closer than split[l],
   the place where level l begins. A square that is not split touches only squares of its level,
   the next finer or the next coarser one: for one of two levels less, its parent, of half the
   square's side, is closer than split[l - 1]; all of that parent is within half a side of the
   square, which is then closer than split[l - 1] plus half a side; and split[l] is more than that.
   Whether the square at a side is split is asked of the same function: no T-junction can be. The
   paper's five quads and its fill-in strips are what this gives along a row.

   Heights. A vertex that is on the grid of level a but not of a + 1 comes and goes when a square
   of level a + 1 is split. All of the square is at least split[a + 1] away then, and so is the
   vertex: from there on it lies on the straight line between its two neighbours on the coarser
   grid. There are none of finer levels on which they could rest in turn: a vertex is less than
   sqrt(5) sides of its own level farther away than split[a + 1] while it is there, its neighbours
   less than sqrt(2) sides more, 1.83 sides of theirs, and up to 1.875 of them beyond the place
   where their level begins vertices have their own height. So a height is a function of the place
   and of the eye alone, for both pages at a border too, and a continuous one of the eye. It is made
   once for all quarters of a square: their corners are the 3 x 3 places of the square.

   All distances are whole numbers of units of 1/8 sample or less: the same on every machine. */

#ifdef TERRIMP_FIXED
#define TERRIMPI_SORTED_LIMIT 16384.0f        /* 3 squares of it are within 31 bits */
#define TERRIMPI_SORTED_NEVER 0x7fffffff
#else
#define TERRIMPI_SORTED_LIMIT 1073741824.0f   /* of 63 bits */
#define TERRIMPI_SORTED_NEVER ((terrimp_sorted_int)0x7fffffff << 31)
#endif

/* ---- the descriptor ---- */

/* The least scale at which a table keeps the distance that blending needs; 0: there is none. */
static float terrimpi_sorted_least_scale(const float *table, uint32_t top)
{
    float least = 2.0f, below = 0.0f;
    uint32_t level;
    for (level = 1; table && level <= top; level++) {
        float step = table[level] - below;
        if (!(step > 0.0f) || !terrimpi_finite(table[level]))
            return 0.0f;
        least = terrimpi_max(level == 1 ? 0.0f : least, (float)(1u << level) / step);
        below = table[level];
    }
    return terrimpi_finite(least) ? least : 0.0f;
}

static uint32_t terrimpi_sorted_top(uint32_t page_quads)
{
    uint32_t top = 0;
    while (2u << top <= page_quads)
        top++;
    return top;
}

static int terrimpi_sorted_is_power(uint32_t value, uint32_t low, uint32_t high)
{
    return terrimpi_within_u32(value, low, high) && (value & (value - 1u)) == 0;
}

/* With a page callback the field says only what a sample is and where. */
static terrimp_result terrimpi_sorted_resolve_field(const terrimp_sorted_desc *desc,
                                                    terrimp_heightfield *field)
{
    static const float none = 0.0f;
    if (desc->page) {
        field->samples = &none;
        field->width = field->depth = desc->page_quads + 1u;
        field->row_bytes = 0;
    }
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, field));
    TERRIMPI_REFUSE(field->wrap && ((field->width - 1u) % desc->page_quads != 0 ||
                    (field->depth - 1u) % desc->page_quads != 0), TERRIMP_E_RANGE);
#ifdef TERRIMP_FIXED
    TERRIMPI_REFUSE(field->format == TERRIMP_FORMAT_F32, TERRIMP_E_RANGE);
#endif
    return TERRIMP_OK;
}

static int terrimpi_sorted_numbers_ok(const terrimp_sorted_desc *d)
{
    float least = terrimpi_sorted_least_scale(d->table, terrimpi_sorted_top(d->page_quads));
    return d->low <= d->high && least > 0.0f && d->scale >= least && d->low_far >= 0.0f &&
           d->low_height >= 0.0f && d->texels_per_px > 0.0f &&
           terrimpi_sorted_is_power(d->page_texels, 1u, 65536u) &&
           terrimpi_within_u32(d->texture_level_count, 1u, 16u) &&
           terrimpi_sorted_is_power(d->texture_window, 1u, 32768u);
}

TERRIMP_API terrimp_result terrimp_sorted_desc_resolve(const terrimp_sorted_desc *in,
                                                       terrimp_sorted_desc *out)
{
    terrimp_sorted_desc d;
    TERRIMPI_REFUSE(!in || !out, TERRIMP_E_NULL);
    d = *in;
    TERRIMPI_DEFAULT(d.page_quads, 64u);
    TERRIMPI_DEFAULT(d.scale, 12.0f);
    TERRIMPI_DEFAULT(d.page_texels, 256u);
    TERRIMPI_DEFAULT(d.texture_level_count, 1u);
    TERRIMPI_DEFAULT(d.texels_per_px, 1.0f);
    TERRIMPI_DEFAULT(d.texture_window, 32u);
    TERRIMPI_REFUSE(!terrimpi_finite2(d.low, d.high) || !terrimpi_finite2(d.scale, d.low_far) ||
                    !terrimpi_finite2(d.low_height, d.texels_per_px), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!terrimpi_sorted_is_power(d.page_quads, 2u,
                                              1u << (TERRIMP_SORTED_LEVELS - 1)) ||
                    !terrimpi_sorted_numbers_ok(&d), TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(d.page && !(d.low < d.high || d.low > 0.0f || d.low < 0.0f), TERRIMP_E_RANGE);
    TERRIMPI_TRY(terrimpi_sorted_resolve_field(&d, &d.field));
    *out = d;
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_sorted_init(const terrimp_sorted_desc *desc,
                                               terrimp_sorted *sorted)
{
    terrimp_sorted_desc d;
    TERRIMPI_REFUSE(!sorted, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_sorted_desc_resolve(desc, &d));
    if (d.low == 0.0f && d.high == 0.0f) {
        terrimp_rect all = terrimpi_rect(0, 0, d.field.width, d.field.depth);
        TERRIMPI_TRY(terrimpi_field_range(&d.field, all, 0, &d.low, &d.high));
    }
    memset(sorted, 0, sizeof *sorted);
    sorted->desc = d;
    sorted->scale = d.scale;
    sorted->top = terrimpi_sorted_top(d.page_quads);
    sorted->least_scale = terrimpi_sorted_least_scale(d.table, sorted->top);
    sorted->pages[0] = (d.field.width - 2u) / d.page_quads + 1u;
    sorted->pages[1] = (d.field.depth - 2u) / d.page_quads + 1u;
    sorted->level = sorted->top;
    return TERRIMP_OK;
}

/* ---- the footprint ---- */

/* Points in plan, in samples from the corner of the eye's page, and the rectangle around them. */
typedef struct terrimpi_sorted_hull {
    float at[16][2], low[2], high[2];
    int count;
} terrimpi_sorted_hull;

static void terrimpi_sorted_hull_add(terrimpi_sorted_hull *hull, const float a[3], const float b[3],
                                     float part)
{
    int k, first = hull->count == 0;
    float *at = hull->at[hull->count++];
    for (k = 0; k < 2; k++) {
        at[k] = a[2 * k] + (b[2 * k] - a[2 * k]) * part;
        hull->low[k] = first ? at[k] : terrimpi_min(hull->low[k], at[k]);
        hull->high[k] = first ? at[k] : terrimpi_max(hull->high[k], at[k]);
    }
}

/* Adds where an edge of the frustum ends or leaves the heights that there are. */
static void terrimpi_sorted_hull_edge(terrimpi_sorted_hull *hull, const float a[3],
                                      const float b[3], float low, float high)
{
    if (terrimpi_within(a[1], low, high))
        terrimpi_sorted_hull_add(hull, a, b, 0.0f);
    if ((a[1] < low) != (b[1] < low))
        terrimpi_sorted_hull_add(hull, a, b, (low - a[1]) / (b[1] - a[1]));
    if ((a[1] > high) != (b[1] > high))
        terrimpi_sorted_hull_add(hull, a, b, (high - a[1]) / (b[1] - a[1]));
}

/* The corners, in plan, of what of the frustum lies between the lowest and the highest height:
   edges from the eye to the corners at z_far, and from each of these to the next. */
static void terrimpi_sorted_hull_frustum(const terrimp_sorted_desc *d, const terrimp_camera *camera,
                                         float z_far, const float eye[3],
                                         terrimpi_sorted_hull *hull)
{
    float corner[4][3];
    terrimp_capture c;
    int i, k;
    terrimpi_camera_capture(camera, &c);
    for (i = 0; i < 4; i++)
        for (k = 0; k < 3; k++) {
            float across = i == 0 || i == 3 ? c.tan_left : c.tan_right;
            float way = c.forward[k] + c.right[k] * across +
                        c.up[k] * (i < 2 ? c.tan_down : c.tan_up);
            float size = k == 0 ? d->field.spacing_x : k == 2 ? d->field.spacing_z : 1.0f;
            corner[i][k] = eye[k] + way * z_far / size;
        }
    hull->count = 0;
    for (i = 0; i < 4; i++) {
        terrimpi_sorted_hull_edge(hull, eye, corner[i], d->low, d->high);
        terrimpi_sorted_hull_edge(hull, corner[i], corner[(i + 1) & 3], d->low, d->high);
    }
}

/* Which of the points lies farthest to the right of the way from one of them in a direction: the
   next corner of the convex hull, counter-clockwise with x to the right and z up. */
static int terrimpi_sorted_hull_next(const terrimpi_sorted_hull *hull, int from)
{
    int i, best = from;
    float x = 0.0f, z = 0.0f;
    for (i = 0; i < hull->count; i++) {
        float to_x = hull->at[i][0] - hull->at[from][0], to_z = hull->at[i][1] - hull->at[from][1];
        float turn = x * to_z - z * to_x;
        int farther = to_x * to_x + to_z * to_z > x * x + z * z;
        if (turn < 0.0f || (turn == 0.0f && farther)) {
            best = i;
            x = to_x;
            z = to_z;
        }
    }
    return best;
}

/* A side of the footprint, between two points: its direction is rounded, but none of the points is
   left outside, nor what is within a sample of them. */
static void terrimpi_sorted_side(terrimp_sorted *s, const terrimpi_sorted_hull *hull, int from,
                                 int to)
{
    float x = hull->at[to][0] - hull->at[from][0], z = hull->at[to][1] - hull->at[from][1];
    float size = 8192.0f / terrimpi_max(terrimpi_abs(x), terrimpi_abs(z)), least = 0.0f;
    terrimp_sorted_side *side = &s->sides[s->side_count++];
    int i;
    side->x = (int32_t)(-z * size);
    side->z = (int32_t)(x * size);
    for (i = 0; i < hull->count; i++) {
        float at = (float)side->x * hull->at[i][0] + (float)side->z * hull->at[i][1];
        least = i == 0 ? at : terrimpi_min(least, at);
    }
    side->at = (terrimp_sorted_int)(terrimpi_abs(least) * 1e-6f - least) + 2 * 8192 + 1;
    side->fall = (side->x < 0 ? -side->x : 0) + (side->z < 0 ? -side->z : 0);
    side->rise = side->x + side->z + side->fall;
}

/* The convex hull of the points, and the pages between its ends along each axis. Of a hull with
   more sides than can be kept the last ones are left out: what is drawn too much does not show. */
static void terrimpi_sorted_footprint(terrimp_sorted *s, const terrimpi_sorted_hull *hull)
{
    float page = (float)s->desc.page_quads;
    int i, k, first = 0, from, to;
    for (k = 0; k < 2; k++) {
        s->bounds[k][0] = terrimpi_round_down((hull->low[k] - 1.0f) / page);
        s->bounds[k][1] = terrimpi_round_down((hull->high[k] + 1.0f) / page);
    }
    for (i = 1; i < hull->count; i++) {
        const float *p = hull->at[i], *q = hull->at[first];
        first = p[0] < q[0] || (p[0] == q[0] && p[1] < q[1]) ? i : first;
    }
    s->side_count = 0;
    from = first;
    do {
        to = terrimpi_sorted_hull_next(hull, from);
        if (to == from)
            return;
        terrimpi_sorted_side(s, hull, from, to);
        from = to;
    } while (to != first && s->side_count < TERRIMP_SORTED_SIDES);
}

/* Whether a side of the footprint crosses a square; -1: it is outside of one. Without branches,
   which nobody could foretell. */
static int terrimpi_sorted_sides(const terrimp_sorted *s, const terrimp_sorted_cell *c)
{
    terrimp_sorted_int x = s->corner[0] + c->at[0], z = s->corner[1] + c->at[1];
    terrimp_sorted_int size = (terrimp_sorted_int)1 << s->level, outside = 0, crossing = 0;
    const terrimp_sorted_side *side, *end = s->sides + s->side_count;
    for (side = s->sides; side < end; side++) {
        terrimp_sorted_int here = side->x * x + side->z * z + side->at;
        outside |= here + side->rise * size;
        crossing |= here - side->fall * size;
    }
    return outside < 0 ? -1 : crossing < 0;
}

/* First and last page of a row that the footprint can touch, or one more: sides are divided in
   pages, of which there are few, so that 32 bits are enough. */
static void terrimpi_sorted_row(const terrimp_sorted *s, int32_t row, int32_t *first,
                                int32_t *last)
{
    int along = s->row_axis;
    uint32_t i;
    *first = s->bounds[along][0];
    *last = s->bounds[along][1];
    for (i = 0; i < s->side_count; i++) {
        const terrimp_sorted_side *side = &s->sides[i];
        int32_t n = along == 0 ? side->x : side->z, m = side->x + side->z - n;
        int32_t most = (int32_t)(side->at >> s->top) + 1 + m * (m > 0 ? row + 1 : row);
        if (n > 0 && -most / n - 1 > *first)
            *first = -most / n - 1;
        if (n < 0 && -(most / n) < *last)
            *last = -(most / n);
    }
}

/* ---- levels ---- */

/* The way along an axis from the eye to the closest point of an interval. */
static terrimp_sorted_int terrimpi_sorted_nearest(terrimp_sorted_int begin, terrimp_sorted_int end)
{
    return begin > 0 ? begin : end < 0 ? end : 0;
}

/* The square of a number of units, or more than any distance. */
static terrimp_sorted_int terrimpi_sorted_square(const terrimp_sorted *s, float units)
{
    terrimp_sorted_int whole;
    if (!(units < (float)s->limit))
        return TERRIMPI_SORTED_NEVER;
    whole = (terrimp_sorted_int)units;
    return whole * whole;
}

static void terrimpi_sorted_set_scale(terrimp_sorted *s, float scale)
{
    float unit = (float)(s->unit[0] > s->unit[1] ? s->unit[0] : s->unit[1]), begins = 0.0f;
    uint32_t level;
    s->scale = scale;
    for (level = 0; level <= s->top; level++) {
        float size = unit * (float)(1u << level), range;
        s->split[level] = terrimpi_sorted_square(s, begins);
        s->whole[level] = terrimpi_sorted_square(s, begins + 1.875f * size);
        begins = scale * (s->desc.table && level < s->top ? s->desc.table[level + 1] * unit
                                                           : 2.0f * size);
        begins = (float)terrimpi_round_down(terrimpi_min(begins, (float)s->limit));
        range = (float)(terrimpi_sorted_square(s, begins) - s->whole[level]);
        s->fade[level] = range > 1.0f ? 1.0f / range : 1.0f;
    }
    s->split[level] = s->whole[s->top] = TERRIMPI_SORTED_NEVER;
}

/* Which sides of the present square are split, for its neighbours are: bits as in the patterns of
   nodes. Only one that is closer than the square can be, across the side that faces the eye: one
   along each axis at most. */
static uint32_t terrimpi_sorted_pattern(const terrimp_sorted *s)
{
    uint32_t pattern = 0;
    int k;
    if (s->level == 0 || s->away > s->whole[s->level])
        return 0;
    for (k = 0; k < 2; k++) {
        terrimp_sorted_int way = s->way[k], size = s->unit[k] << s->level;
        terrimp_sorted_int beside = way > 0 ? terrimpi_sorted_nearest(way - size, way)
                                             : terrimpi_sorted_nearest(way, way + size);
        if (s->away - way * way + beside * beside < s->split[s->level])
            pattern |= (way > 0 ? 1u : 2u) << (k == 0 ? 2 : 0);
    }
    return pattern;
}

/* ---- heights ---- */

static int32_t terrimpi_sorted_clamp(const terrimp_sorted *s, int axis, int32_t at)
{
    return at < s->last[axis] ? at : s->last[axis];
}

/* A sample of the page as it is stored, or the last one of its row or column. */
static terrimp_sorted_height terrimpi_sorted_sample(const terrimp_sorted *s, int32_t x, int32_t z)
{
    const terrimp_sorted_height one = sizeof(terrimp_sorted_int) > 4 ? 1 : 256;
    const void *row;
    if (s->partial) {
        x = terrimpi_sorted_clamp(s, 0, x) >> s->page.level;
        z = terrimpi_sorted_clamp(s, 1, z) >> s->page.level;
    }
    row = (const char *)s->page.samples + (size_t)z * s->page.row_bytes;
    switch (s->desc.field.format) {
#ifndef TERRIMP_FIXED
    case TERRIMP_FORMAT_F32: return ((const float *)row)[x];
#endif
    case TERRIMP_FORMAT_U16: return (terrimp_sorted_height)((const uint16_t *)row)[x] * one;
    case TERRIMP_FORMAT_S16: return (terrimp_sorted_height)((const int16_t *)row)[x] * one;
    default: return (terrimp_sorted_height)((const uint8_t *)row)[x] * one;
    }
}

/* From which level on the heights at a place of the page are here. */
static uint32_t terrimpi_sorted_here(const terrimp_sorted *s, int32_t x, int32_t z)
{
    int32_t quads = (int32_t)s->desc.page_quads;
    uint32_t level = s->page.level;
    int side;
    for (side = 0; side < 4; side++)
        if ((terrimpi_along_x(side) ? z : x) == (side & 1 ? quads : 0))
            level = terrimpi_max_u32(level, s->side_levels[side]);
    return level;
}

/* from + (to - from) * part / whole. Ends and halves are exact, so that an edge is the same for
   both of its sides. */
static terrimp_sorted_height terrimpi_sorted_mix(terrimp_sorted_height from,
                                                 terrimp_sorted_height to, int32_t part,
                                                 int32_t whole)
{
    if (part * 2 == whole)
        return (from + to) / 2;
    if (part == whole)
        return to;
#ifdef TERRIMP_FIXED
    return from + (to - from) / 16 * part / whole * 16;
#else
    return from + (to - from) * ((float)part / (float)whole);
#endif
}

/* What a height that is not a corner of its square rests on where the next level begins: mostly the
   middle between two others, at its sides or on the diagonal. Where the field ends within the
   square it is a place of one of its two triangles. */
static terrimp_sorted_height terrimpi_sorted_rest(const terrimp_sorted *s,
                                                  const terrimp_sorted_cell *c, uint32_t place,
                                                  int32_t x, int32_t z, int32_t size)
{
    uint32_t step = place & 5u;
    terrimp_sorted_height from = c->heights[place - step], to = c->heights[place + step], corner;
    int32_t u, v, width, length;
    if (!s->partial)
        return (from + to) / 2;
    u = terrimpi_sorted_clamp(s, 0, x) - c->at[0];
    v = terrimpi_sorted_clamp(s, 1, z) - c->at[1];
    width = terrimpi_sorted_clamp(s, 0, c->at[0] + size) - c->at[0];
    length = terrimpi_sorted_clamp(s, 1, c->at[1] + size) - c->at[1];
    if (step == 1u)
        return terrimpi_sorted_mix(from, to, u, width);
    if (step == 4u || u * length == v * width)
        return terrimpi_sorted_mix(from, to, v, length);
    corner = c->heights[u * length > v * width ? 2 : 8];
    if (u * length > v * width)
        return terrimpi_sorted_mix(from, corner, u, width) - corner +
               terrimpi_sorted_mix(corner, to, v, length);
    return terrimpi_sorted_mix(from, corner, v, length) - corner +
           terrimpi_sorted_mix(corner, to, u, width);
}

/* Makes the heights of places of a square that come when it is split, into quarters of a level. */
static void terrimpi_sorted_heights(const terrimp_sorted *s, terrimp_sorted_cell *c,
                                    const uint8_t *places, uint32_t count, uint32_t level)
{
    const int32_t size = 1 << level;
    for (; count > 0; count--, places++) {
        uint32_t place = *places, column = place & 3u, row = place >> 2;
        int32_t x = c->at[0] + (int32_t)column * size, z = c->at[1] + (int32_t)row * size;
        terrimp_sorted_int away = c->away[0][column] * c->away[0][column] +
                                  c->away[1][row] * c->away[1][row] + s->rise;
        terrimp_sorted_int left = s->split[level + 1u] - away;
        int here = !s->partial || terrimpi_sorted_here(s, x, z) <= level;
        terrimp_sorted_height *height = &c->heights[place];
        if (here && away <= s->whole[level]) {
            *height = terrimpi_sorted_sample(s, x, z);
            continue;
        }
        *height = terrimpi_sorted_rest(s, c, place, x, z, 2 * size);
        if (here && left > 0) {
#ifdef TERRIMP_FIXED
            terrimp_sorted_int range = s->split[level + 1u] - s->whole[level];
            int shift = range < 1 << 16 ? 0 : 15;
            *height += (terrimpi_sorted_sample(s, x, z) - *height) / 64 *
                       ((left >> shift) * 64 / ((range >> shift) + 1));
#else
            *height += (terrimpi_sorted_sample(s, x, z) - *height) *
                       terrimpi_min((float)left * s->fade[level], 1.0f);
#endif
        }
    }
}

/* ---- the order ---- */

/* The k-th of count places from first on, from both ends towards 0, or away from it. */
static int32_t terrimpi_sorted_outside_in(int32_t first, int32_t count, int32_t k, int away)
{
    int32_t last = first + count - 1, after = last < 0 ? 0 : first > 0 ? count - 1 : last;
    k = away ? count - 1 - k : k;
    return k < after ? last - k : first + k - after;
}

static void terrimpi_sorted_restart(terrimp_sorted *s)
{
    s->rows = s->bounds[1 - s->row_axis][1] - s->bounds[1 - s->row_axis][0] + 1;
    s->row = s->col = s->cols = 0;
    s->level = s->top;
    s->triangle_count = 0;
}

/* Looks at the present square, of which begin and level are known. Returns 1 if it is drawn as a
   whole; 0 if it is split: then its first quarter is the next one; -1 when it lies outside. */
static int terrimpi_sorted_visit(terrimp_sorted *s, terrimp_sorted_cell *c)
{
    int k, crossed = c->crossed ? terrimpi_sorted_sides(s, c) : 0;
    if (crossed < 0 || c->at[0] >= s->last[0] || c->at[1] >= s->last[1])
        return -1;
    for (k = 0; k < 2; k++) {
        terrimp_sorted_int *away = c->away[k], size = s->unit[k] << s->level;
        away[1] = away[0] + (size >> 1);
        away[2] = away[0] + size;
        s->way[k] = terrimpi_sorted_nearest(away[0], away[2]);
    }
    s->away = s->way[0] * s->way[0] + s->way[1] * s->way[1] + s->rise;
    if (s->away >= s->split[s->level])
        return 1;
    c->crossed = (uint8_t)crossed;
    c->child = 0;
    c->order = (uint8_t)((c->away[0][1] > 0) | (c->away[1][1] > 0) << 1);
    c->order ^= s->desc.front_to_back ? 3 : 0;
    s->level--;
    return 0;
}

/* Goes to the next quarter of a square, of two the one first that the eye is not at; rows come
   before columns. Returns its place. */
static uint32_t terrimpi_sorted_quarter(const terrimp_sorted *s, terrimp_sorted_cell *whole)
{
    static const uint8_t turns[2][4] = { { 0, 1, 2, 3 }, { 0, 2, 1, 3 } };
    uint32_t k = turns[s->row_axis][whole->child++] ^ (uint32_t)whole->order;
    uint32_t x = k & 1u, z = k >> 1, size = 1u << s->level;
    terrimp_sorted_cell *c = whole - 1;
    c->at[0] = whole->at[0] + (int32_t)(x * size);
    c->at[1] = whole->at[1] + (int32_t)(z * size);
    c->away[0][0] = whole->away[0][x];
    c->away[1][0] = whole->away[1][z];
    c->crossed = whole->crossed;
    return x + 4u * z;
}

/* ---- pages ---- */

/* The level whose texels are one to two pixels large at the page's closest point. A coarser one is
   left only a tenth closer than where it began. */
static uint32_t terrimpi_sorted_texture_level(const terrimp_sorted *s)
{
    const terrimp_sorted_desc *d = &s->desc;
    uint32_t window = d->texture_window - 1u, level = 0;
    uint8_t *kept = d->texture_levels;
    if (kept)
        kept += ((uint32_t)s->page.z & window) * d->texture_window + ((uint32_t)s->page.x & window);
    if (kept && *kept < d->texture_level_count) {
        level = *kept;
        while (level > 0 && s->away >> 2u * (level - 1u) < s->texel_steps[1])
            level--;
    }
    while (level + 1u < d->texture_level_count && s->away >> 2u * level >= s->texel_steps[0])
        level++;
    if (kept)
        *kept = (uint8_t)level;
    return level;
}

/* A page's column or row in a field that wraps. */
static uint32_t terrimpi_sorted_tile(int32_t page, uint32_t count)
{
    int32_t tile = page % (int32_t)count;
    return (uint32_t)(tile < 0 ? tile + (int32_t)count : tile);
}

/* Where the field has a page's samples. */
static void terrimpi_sorted_field_page(terrimp_sorted *s, terrimp_sorted_page *page)
{
    const terrimp_heightfield *f = &s->desc.field;
    uint32_t quads = s->desc.page_quads, x = terrimpi_sorted_tile(page->x, s->pages[0]) * quads;
    uint32_t z = terrimpi_sorted_tile(page->z, s->pages[1]) * quads;
    page->samples = (const char *)terrimpi_field_row(f, z) + x *
        terrimpi_field_sample_bytes(f->format);
    page->row_bytes = f->row_bytes;
    s->last[0] = (int32_t)terrimpi_min_u32(quads, f->width - 1u - x);
    s->last[1] = (int32_t)terrimpi_min_u32(quads, f->depth - 1u - z);
    s->partial = s->last[0] < (int32_t)quads || s->last[1] < (int32_t)quads;
}

/* Asks the host for a page and for how much of those beside it is here: along a side heights are
   those that both have. Returns 0 when it is not to be drawn. */
static int terrimpi_sorted_ask(terrimp_sorted *s, terrimp_sorted_page *page)
{
    int i;
    s->partial = 0;
    s->desc.page(s->desc.user, page);
    if (page->level > s->top || !page->samples)
        return 0;
    for (i = 0; i < 4; i++) {
        terrimp_sorted_page beside = *page;
        beside.x += (i == TERRIMP_SIDE_X1) - (i == TERRIMP_SIDE_X0);
        beside.z += (i == TERRIMP_SIDE_Z1) - (i == TERRIMP_SIDE_Z0);
        beside.only_level = 1;
        beside.level = 0;
        s->desc.page(s->desc.user, &beside);
        if (beside.level > s->top)
            beside.level = 0;
        s->side_levels[i] = (uint8_t)terrimpi_max_u32(page->level, beside.level);
        s->partial |= s->side_levels[i] > 0;
    }
    return 1;
}

/* Goes to the next page of the frame; 0: there is none. */
static int terrimpi_sorted_next_page(terrimp_sorted *s)
{
    int along = s->row_axis, across = 1 - along, k;
    terrimp_sorted_cell *c = &s->cells[s->top];
    int32_t place[2];
    while (s->col >= s->cols) {
        int32_t last;
        if (s->row >= s->rows)
            return 0;
        s->page_row = terrimpi_sorted_outside_in(s->bounds[across][0], s->rows, s->row++,
                                                 s->desc.front_to_back);
        terrimpi_sorted_row(s, s->page_row, &s->first_col, &last);
        s->cols = last - s->first_col + 1;
        s->col = 0;
    }
    place[across] = s->page_row;
    place[along] = terrimpi_sorted_outside_in(s->first_col, s->cols, s->col++,
                                              s->desc.front_to_back);
    memset(&s->page, 0, sizeof s->page);
    s->page.x = place[0] + s->eye_page[0];
    s->page.z = place[1] + s->eye_page[1];
    for (k = 0; k < 2; k++) {
        s->last[k] = (int32_t)s->desc.page_quads;
        s->corner[k] = place[k] * s->last[k];
        c->at[k] = 0;
        c->away[k][0] = s->corner[k] * s->unit[k] - s->eye[k];
    }
    c->crossed = 1;
    if (!s->desc.page)
        terrimpi_sorted_field_page(s, &s->page);
    return 1;
}

/* Readies a page to be drawn; 0: it is not here. Its corners have their own heights. */
static int terrimpi_sorted_open(terrimp_sorted *s)
{
    terrimp_sorted_height *heights = s->cells[s->top].heights;
    int32_t last = (int32_t)s->desc.page_quads;
    s->page.texture_level = terrimpi_sorted_texture_level(s);
    if (s->desc.page && !terrimpi_sorted_ask(s, &s->page)) {
        s->level = s->top;
        return 0;
    }
    heights[0] = terrimpi_sorted_sample(s, 0, 0);
    heights[2] = terrimpi_sorted_sample(s, last, 0);
    heights[8] = terrimpi_sorted_sample(s, 0, last);
    heights[10] = terrimpi_sorted_sample(s, last, last);
    return 1;
}

/* Looks at the next quarter or page. Returns 1 when it is the present square, 0 when it is not, -1
   when there is none. to_count: heights are not wanted. */
static int terrimpi_sorted_look(terrimp_sorted *s, int to_count)
{
    static const uint8_t inner[5] = { 1, 4, 5, 6, 9 };
    terrimp_sorted_cell *c = &s->cells[s->level];
    terrimp_sorted_height *from = c->heights;
    int found, is_page;
    for (; s->level < s->top && c[1].child == 4; c++)
        s->level++;
    is_page = s->level == s->top;
    if (is_page && !terrimpi_sorted_next_page(s))
        return -1;
    if (!is_page)
        from = c[1].heights + terrimpi_sorted_quarter(s, c + 1);
    found = terrimpi_sorted_visit(s, c);
    if (found < 0 || to_count)
        return found > 0;
    if (is_page && !terrimpi_sorted_open(s))
        return 0;
    if (!is_page) { /* its corners are places of the square that it is a quarter of */
        c->heights[0] = from[0];
        c->heights[2] = from[1];
        c->heights[8] = from[4];
        c->heights[10] = from[5];
    }
    if (!found)
        terrimpi_sorted_heights(s, c, inner, 5, s->level);
    return found;
}

/* ---- triangles ---- */

/* Appends a triangle; the other half's turn the other way. */
static void terrimpi_sorted_triangle(terrimp_sorted_square *out, int a, int b, int c, int turned)
{
    uint8_t *indices = out->indices + 3 * out->triangle_count++;
    indices[0] = (uint8_t)a;
    indices[1] = (uint8_t)(turned ? c : b);
    indices[2] = (uint8_t)(turned ? b : c);
}

/* Whether of the two sides of the plane through two places of a square the one with the half's
   corner comes first in the order. In the half that is not turned it is to the right of the way
   from the first place to the second. */
static int terrimpi_sorted_corner_first(const terrimp_sorted *s, const terrimp_sorted_cell *c,
                                        int a, int b, int turned)
{
    int eye_left = c->away[1][b >> 2] * c->away[0][a & 3] > c->away[0][b & 3] * c->away[1][a >> 2];
    return (eye_left != turned) != (s->desc.front_to_back != 0);
}

/* Half of a square: the triangle of vertices 0, 3 and corner, whose sides that meet in the corner
   may have vertices in the middle (0: none), begin towards 0, end towards 3. The plane through
   these cuts off a triangle with the corner; what is left of two has its corner at the first.
   places: of the vertices. */
static void terrimpi_sorted_half(const terrimp_sorted *s, terrimp_sorted_square *out,
                                 const uint8_t places[6], int corner, int begin, int end,
                                 int turned)
{
    int a = begin, b = end ? end : 3;
    int first = terrimpi_sorted_corner_first(s, &s->cells[s->level], places[a], places[b],
                                             turned);
    if (first)
        terrimpi_sorted_triangle(out, a, b, corner, turned);
    if (begin && end)
        terrimpi_sorted_half(s, out, places, begin, 0, end, turned);
    else if (begin || end)
        terrimpi_sorted_triangle(out, b, a, begin ? 0 : 3, turned);
    if (!first)
        terrimpi_sorted_triangle(out, a, b, corner, turned);
}

/* The triangles of the present square, of whose sides some have a vertex in the middle. */
static void terrimpi_sorted_triangles(const terrimp_sorted *s, terrimp_sorted_square *out,
                                      const uint8_t places[6], const int middle[4])
{
    static const uint8_t plain[2][6] = { { 0, 2, 3, 0, 3, 1 }, { 0, 3, 1, 0, 2, 3 } };
    int first = terrimpi_sorted_corner_first(s, &s->cells[s->level], 0, 10, 0), i;
    if (out->vertex_count == 4) {
        memcpy(out->indices, plain[first], sizeof plain[0]);
        out->triangle_count = 2;
        return;
    }
    out->triangle_count = 0;
    for (i = 0; i < 2; i++) {
        int turned = i == first;
        terrimpi_sorted_half(s, out, places, 1 + turned,
                             middle[turned ? TERRIMP_SIDE_X0 : TERRIMP_SIDE_Z0],
                             middle[turned ? TERRIMP_SIDE_Z1 : TERRIMP_SIDE_X1], turned);
    }
}

/* Cuts off what of the present square is beyond the last sample. */
static void terrimpi_sorted_trim(const terrimp_sorted *s, terrimp_sorted_cell *c)
{
    int i, k;
    for (k = 0; k < 2; k++)
        for (i = 1; i < 3; i++) {
            int32_t over = c->at[k] + (i << s->level >> 1) - s->last[k];
            c->away[k][i] -= over > 0 ? over * s->unit[k] : 0;
        }
}

/* Writes the present square: its corners, then the middles of its sides that are split. */
static void terrimpi_sorted_emit(terrimp_sorted *s, terrimp_sorted_square *out)
{
    static const uint8_t sides[4] = { 1, 9, 4, 6 };
    uint8_t places[6] = { 0, 2, 8, 10, 0, 0 };
    terrimp_sorted_cell *c = &s->cells[s->level];
    uint32_t pattern = terrimpi_sorted_pattern(s), count = 4, i;
    int32_t x0, z0, quads = (int32_t)s->desc.page_quads;
    int middle[4] = { 0, 0, 0, 0 };
    for (i = 0; pattern >> i; i++)
        if (pattern >> i & 1u) {
            middle[i] = (int)count;
            places[count++] = sides[i];
        }
    if (count > 4u)
        terrimpi_sorted_heights(s, c, places + 4, count - 4u, s->level - 1u);
    if (s->partial)
        terrimpi_sorted_trim(s, c);
    x0 = s->page.x * quads;
    z0 = s->page.z * quads;
    for (i = 0; i < count; i++) {
        terrimp_sorted_vertex *v = &out->vertices[i];
        int32_t x = c->at[0] + ((places[i] & 3) << s->level >> 1);
        int32_t z = c->at[1] + ((places[i] >> 2) << s->level >> 1);
        v->x = x0 + (s->partial ? terrimpi_sorted_clamp(s, 0, x) : x);
        v->z = z0 + (s->partial ? terrimpi_sorted_clamp(s, 1, z) : z);
        v->height = c->heights[places[i]];
#ifndef TERRIMP_FIXED
        v->height = terrimpi_field_world_height(&s->desc.field, v->height);
#endif
    }
    out->page_x = s->page.x;
    out->page_z = s->page.z;
    out->level = (uint8_t)s->level;
    out->texture_level = (uint8_t)s->page.texture_level;
    out->vertex_count = (uint8_t)count;
    terrimpi_sorted_triangles(s, out, places, middle);
    s->triangle_count += out->triangle_count;
}

/* Gives out the next squares, or counts them and their triangles. */
static uint32_t terrimpi_sorted_walk(terrimp_sorted *s, terrimp_sorted_square *squares,
                                     uint32_t capacity)
{
    uint32_t count = 0;
    int found = 0;
    while (count < capacity && found >= 0) {
        found = terrimpi_sorted_look(s, !squares);
        if (found <= 0)
            continue;
        if (squares)
            terrimpi_sorted_emit(s, &squares[count]);
        else
            s->triangle_count += 2u + terrimpi_mip_coarse_sides(terrimpi_sorted_pattern(s));
        count++;
    }
    return count;
}

TERRIMP_API uint32_t terrimp_sorted_next(terrimp_sorted *sorted, terrimp_sorted_square *squares,
                                         uint32_t capacity)
{
    return sorted && squares ? terrimpi_sorted_walk(sorted, squares, capacity) : 0;
}

TERRIMP_API void terrimp_sorted_position(const terrimp_sorted *sorted,
                                         const terrimp_sorted_vertex *vertex, float position[3])
{
    const terrimp_heightfield *f = &sorted->desc.field;
    position[0] = terrimpi_float(f->origin_x + (float)vertex->x * f->spacing_x);
    position[2] = terrimpi_float(f->origin_z + (float)vertex->z * f->spacing_z);
#ifdef TERRIMP_FIXED
    position[1] = terrimpi_field_world_height(f, (float)vertex->height * (1.0f / 256.0f));
#else
    position[1] = vertex->height;
#endif
}

/* The three texels of a line that are mixed at one of them: before, itself, after. At an end where
   nothing is repeated it is but itself. */
static void terrimpi_sorted_taps(uint32_t at, uint32_t count, int wrap, uint32_t taps[3])
{
    int inside = at > 0 && at + 1u < count;
    taps[0] = inside ? at - 1u : wrap ? count - 2u : at;
    taps[1] = at;
    taps[2] = inside ? at + 1u : wrap ? 1u : at;
}

TERRIMP_API terrimp_result terrimp_sorted_halve(const uint8_t *texels, uint32_t width,
                                                uint32_t height, uint32_t channels, int wrap,
                                                uint8_t *out)
{
    static const uint32_t weights[3] = { 1, 2, 1 };
    uint32_t x, y, c, i, k, across[3], down[3];
    TERRIMPI_REFUSE(!texels || !out, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_within_u32(width, 3, TERRIMP_MAX_DIM) || width % 2u == 0 ||
                    !terrimpi_within_u32(height, 3, TERRIMP_MAX_DIM) || height % 2u == 0 ||
                    !terrimpi_within_u32(channels, 1, 4), TERRIMP_E_RANGE);
    for (y = 0; y < height; y += 2u) {
        terrimpi_sorted_taps(y, height, wrap, down);
        for (x = 0; x < width; x += 2u) {
            terrimpi_sorted_taps(x, width, wrap, across);
            for (c = 0; c < channels; c++) {
                uint32_t sum = 8;
                for (i = 0; i < 9u; i++) {
                    k = i / 3u;
                    sum += weights[k] * weights[i % 3u] *
                           texels[((size_t)down[k] * width + across[i % 3u]) * channels + c];
                }
                *out++ = (uint8_t)(sum / 16u);
            }
        }
    }
    return TERRIMP_OK;
}

/* ---- the frame ---- */

/* The triangles of the frame at a scale. */
static uint32_t terrimpi_sorted_count(terrimp_sorted *s, float scale)
{
    terrimpi_sorted_set_scale(s, scale);
    terrimpi_sorted_restart(s);
    terrimpi_sorted_walk(s, NULL, 0xffffffffu);
    return s->triangle_count;
}

/* Finds the scale whose triangles are 97 to 100 % of max_triangles, or the largest that does not
   pass it. It begins with that of the frame before and asks for the count of the frame that is to
   come: so nothing swings. Triangles go about with the square of the scale; where that guess leaves
   what is known to be too small and too large, the next one is between. */
static void terrimpi_sorted_solve(terrimp_sorted *s)
{
    const float most = (float)s->desc.max_triangles, largest = 65536.0f;
    float low = s->least_scale, high = largest, scale = s->scale;
    int i;
    for (i = 0; i < 16 && low < high; i++) {
        float count = (float)terrimpi_sorted_count(s, scale);
        if (count <= most && (count >= 0.97f * most || scale >= largest))
            return;
        *(count > most ? &high : &low) = scale;
        scale *= TERRIMP_SQRTF(0.985f * most / terrimpi_max(count, 1.0f));
        if (!(scale > low && scale < high))
            scale = i == 0 ? terrimpi_clamp(scale, low, high) : TERRIMP_SQRTF(low * high);
    }
    terrimpi_sorted_set_scale(s, low);
}

/* How far the frame reaches: the lower the eye, the closer. */
static float terrimpi_sorted_z_far(const terrimp_sorted_desc *d, const terrimp_camera *camera)
{
    float span = d->low_height > 0.0f ? d->low_height : d->high - d->low, ground, part;
    if (!(d->low_far > 0.0f) || !(d->low_far < camera->z_far) || !(span > 0.0f))
        return camera->z_far;
    if (d->page || terrimp_heightfield_height(&d->field, camera->eye[0], camera->eye[2], &ground))
        ground = d->low;
    part = terrimpi_clamp((camera->eye[1] - ground) / span, 0.0f, 1.0f);
    return d->low_far + (camera->z_far - d->low_far) * part;
}

/* Chooses units, as fine as the squares of all distances allow, and puts the eye in its page. */
static int terrimpi_sorted_units(terrimp_sorted *s, const float eye[3],
                                 const terrimpi_sorted_hull *hull)
{
    const terrimp_sorted_desc *d = &s->desc;
    float larger = terrimpi_max(d->field.spacing_x, d->field.spacing_z), unit = 4096.0f, rise;
    float reach = 0.0f, page = (float)d->page_quads;
    int k;
    for (k = 0; k < 2; k++)
        reach = terrimpi_max(reach, terrimpi_max(-hull->low[k], hull->high[k]));
    while (unit >= 8.0f && !((reach + 3.0f * page) * unit < TERRIMPI_SORTED_LIMIT))
        unit *= 0.5f;
    if (unit < 8.0f || !(reach < 1024.0f * page))
        return 0;
    for (k = 0; k < 2; k++) {
        float size = (k == 0 ? d->field.spacing_x : d->field.spacing_z) / larger * unit;
        s->unit[k] = (terrimp_sorted_int)terrimpi_max(size + 0.5f, 1.0f);
        s->eye[k] = (terrimp_sorted_int)terrimpi_round_down(eye[2 * k] * (float)s->unit[k]);
    }
    rise = terrimpi_max(terrimpi_max(eye[1] - d->high, d->low - eye[1]), 0.0f) / larger * unit;
    s->limit = (terrimp_sorted_int)(TERRIMPI_SORTED_LIMIT - unit);
    s->rise = terrimpi_sorted_square(s, terrimpi_min(rise, (float)(s->limit - 1)));
    return 1;
}

/* Where texture levels begin: a texel of level 0 at distance d covers K texel / d pixels. */
static void terrimpi_sorted_texels(terrimp_sorted *s, const terrimp_camera *camera)
{
    const terrimp_sorted_desc *d = &s->desc;
    float unit = (float)(s->unit[0] > s->unit[1] ? s->unit[0] : s->unit[1]);
    float at = 2.0f * unit * terrimpi_camera_pixel_factor(camera) * d->texels_per_px *
               (float)d->page_quads / (float)d->page_texels;
    s->texel_steps[0] = terrimpi_sorted_square(s, at);
    s->texel_steps[1] = terrimpi_sorted_square(s, at / 1.1f);
}

/* Rows across the view come before columns; beyond the last page of a field there is nothing. */
static void terrimpi_sorted_arrange(terrimp_sorted *s, const terrimp_camera *camera)
{
    int k;
    s->row_axis = terrimpi_abs(camera->forward[0]) > terrimpi_abs(camera->forward[2]);
    for (k = 0; k < 2 && !s->desc.page && !s->desc.field.wrap; k++) {
        int32_t first = -s->eye_page[k], last = first + (int32_t)s->pages[k] - 1;
        s->bounds[k][0] = s->bounds[k][0] > first ? s->bounds[k][0] : first;
        s->bounds[k][1] = s->bounds[k][1] < last ? s->bounds[k][1] : last;
    }
}

TERRIMP_API terrimp_result terrimp_sorted_begin(terrimp_sorted *sorted,
                                                const terrimp_camera *camera)
{
    const terrimp_heightfield *f;
    terrimp_camera c;
    terrimpi_sorted_hull hull;
    float eye[3], quads;
    int k;
    TERRIMPI_REFUSE(!sorted, TERRIMP_E_NULL);
    sorted->level = sorted->top;
    sorted->row = sorted->rows = sorted->col = sorted->cols = 0;
    TERRIMPI_TRY(terrimp_camera_resolve(camera, &c));
    TERRIMPI_REFUSE(c.orthographic || c.z_far > TERRIMPI_CAMERA_FARTHEST, TERRIMP_E_RANGE);
    f = &sorted->desc.field;
    quads = (float)sorted->desc.page_quads;
    eye[0] = (c.eye[0] - f->origin_x) / f->spacing_x;
    eye[1] = c.eye[1];
    eye[2] = (c.eye[2] - f->origin_z) / f->spacing_z;
    for (k = 0; k < 2; k++) {
        TERRIMPI_REFUSE(!(terrimpi_abs(eye[2 * k]) < 8388608.0f), TERRIMP_E_RANGE);
        sorted->eye_page[k] = terrimpi_round_down(eye[2 * k] / quads);
        eye[2 * k] -= (float)sorted->eye_page[k] * quads;
    }
    terrimpi_sorted_hull_frustum(&sorted->desc, &c, terrimpi_sorted_z_far(&sorted->desc, &c), eye,
                                 &hull);
    if (hull.count == 0)
        return TERRIMP_OK;
    TERRIMPI_REFUSE(!terrimpi_sorted_units(sorted, eye, &hull), TERRIMP_E_RANGE);
    terrimpi_sorted_footprint(sorted, &hull);
    terrimpi_sorted_arrange(sorted, &c);
    terrimpi_sorted_texels(sorted, &c);
    if (sorted->desc.max_triangles)
        terrimpi_sorted_solve(sorted);
    else
        terrimpi_sorted_set_scale(sorted, sorted->desc.scale);
    terrimpi_sorted_restart(sorted);
    return TERRIMP_OK;
}

/* ---- the draws of a view ---- */

/* A node is a triangulation of a rectangle: what may hide what across an inner edge is told by the
   side of the edge's plane that the eye is on, and what is in order across each edge is in order.
   Blocks of 2 x 2 quads hold whole triangles even where a coarser neighbour makes them merge, so
   rows and columns of blocks come from both ends towards the eye's. Within a block four edges meet
   at its middle, along x and z, and a diagonal where a side has merged; they tell which of the four
   quads comes first. The last edge is a quad's own diagonal. */
typedef struct terrimpi_sorted_block {
    terrimpi_mip_writer out;
    terrimpi_terrain_pattern part; /* quads that are drawn */
    const float *x, *z;    /* of its columns and rows of vertices, from the eye on */
} terrimpi_sorted_block;

/* The quads of a block, two bits each, first one lowest; by which of these is closer than the one
   before it: bit 0 the second of the first row, 1 of the second row, 2 of the first column, 3 of
   the second one. Two of them, 6 and 9, cannot be. */
static const uint8_t terrimpi_sorted_quads[16] = {
    0x27, 0x4b, 0x1e, 0x72, 0x87, 0x9c, 0x78, 0x78, 0x2d, 0xb4, 0xc9, 0xd2, 0xb1, 0xb4, 0xe1, 0xe4
};

/* Below 0: the eye, at the origin, is where +x and -z are of the line from vertex (i, j) to (k, l),
   which lies at +x of it; above 0: it is on the other side. */
static float terrimpi_sorted_cross(const terrimpi_sorted_block *b, int i, int j, int k, int l)
{
    return (b->z[l] - b->z[j]) * b->x[i] - (b->x[k] - b->x[i]) * b->z[j];
}

/* The order of a block's quads; *sides: those of it that are coarse. */
static uint32_t terrimpi_sorted_block_order(const terrimpi_sorted_block *b, uint32_t x, uint32_t z,
                                            uint32_t *sides)
{
    uint32_t last = b->out.quads - 2u, coarse = b->out.pattern;
    uint32_t bits = (b->x[1] < 0.0f ? 3u : 0u) | (b->z[1] < 0.0f ? 12u : 0u), merged;
    coarse &= (z == 0 ? 1u : 0u) | (z == last ? 2u : 0u) | (x == 0 ? 4u : 0u) |
              (x == last ? 8u : 0u);
    *sides = coarse;
    merged = coarse & 9u; /* with the quad at the corner of +x, -z */
    if (merged)
        bits = terrimpi_sorted_cross(b, 1, 1, 2, 0) > 0.0f ? bits | merged : bits & ~merged;
    merged = coarse & 6u;
    if (merged)
        bits = terrimpi_sorted_cross(b, 0, 2, 1, 1) > 0.0f ? bits | merged : bits & ~merged;
    return terrimpi_sorted_quads[bits];
}

static void terrimpi_sorted_write_block(terrimpi_sorted_block *b, uint32_t x, uint32_t z)
{
    uint32_t k, sides, row = b->out.quads + 1u;
    uint32_t order = terrimpi_sorted_block_order(b, x, z, &sides);
    for (k = 0; k < 4u; k++, order >>= 2) {
        uint32_t dx = order & 1u, dz = order >> 1 & 1u, i = x + dx, j = z + dz, at = j * row + i;
        int first = terrimpi_sorted_cross(b, (int)dx, (int)dz, (int)dx + 1, (int)dz + 1) < 0.0f;
        uint16_t v[6], *to = sides ? v : b->out.out;
        uint16_t *one = to + (first ? 0 : 3), *other = to + (first ? 3 : 0);
        if (i - b->part.x0 >= b->part.x1 - b->part.x0 || j - b->part.z0 >= b->part.z1 - b->part.z0)
            continue;
        one[0] = other[0] = (uint16_t)at;
        one[1] = (uint16_t)(at + row);
        one[2] = other[1] = (uint16_t)(at + row + 1u);
        other[2] = (uint16_t)(at + 1u);
        if (sides) {
            one[0] = other[0] = terrimpi_mip_index(&b->out, i, j);
            one[1] = terrimpi_mip_index(&b->out, i, j + 1u);
            one[2] = other[1] = terrimpi_mip_index(&b->out, i + 1u, j + 1u);
            other[2] = terrimpi_mip_index(&b->out, i + 1u, j);
            terrimpi_mip_triangle(&b->out, v[0], v[1], v[2]);
            terrimpi_mip_triangle(&b->out, v[3], v[4], v[5]);
        } else {
            b->out.out += 6;
        }
    }
}

/* The next of the blocks at *low to *high along an axis: from both ends towards the eye's, at 0. */
static uint32_t terrimpi_sorted_turn(const float *places, uint32_t *low, uint32_t *high)
{
    int past = places[*low + 2u] <= 0.0f;
    uint32_t at = past ? *low : *high - 2u;
    *low += past ? 2u : 0u;
    *high -= past ? 0u : 2u;
    return at;
}

static void terrimpi_sorted_write(terrimpi_sorted_block *b, const terrimp_quadtree *tree,
                                  const terrimp_node *n, const float eye[3])
{
    float xs[129], zs[129]; /* of the largest chunk */
    uint32_t rows[2], cols[2], k, x, z;
    for (k = 0; k <= tree->chunk_quads; k++) {
        xs[k] = terrimpi_tree_x(tree, n->level, n->x * tree->chunk_quads + k) - eye[0];
        zs[k] = terrimpi_tree_z(tree, n->level, n->z * tree->chunk_quads + k) - eye[2];
    }
    rows[0] = b->part.z0 & ~1u;
    rows[1] = (b->part.z1 + 1u) & ~1u;
    while (rows[0] < rows[1]) {
        z = terrimpi_sorted_turn(zs, &rows[0], &rows[1]);
        b->z = zs + z;
        cols[0] = b->part.x0 & ~1u;
        cols[1] = (b->part.x1 + 1u) & ~1u;
        while (cols[0] < cols[1]) {
            x = terrimpi_sorted_turn(xs, &cols[0], &cols[1]);
            b->x = xs + x;
            terrimpi_sorted_write_block(b, x, z);
        }
    }
}

/* The pattern of a command, or the rows of one's column, and its coarse sides. */
static int terrimpi_sorted_find(uint32_t quads, const terrimp_ground_command *command,
                                terrimpi_terrain_pattern *part, uint32_t *coarse)
{
    uint32_t i, first = command->first_index;
    uint32_t strips = terrimpi_terrain_apron_count(quads) * TERRIMPI_TERRAIN_DIRECTIONS;
    terrimp_pattern pattern;
    *part = terrimpi_terrain_pattern_of(quads, 0);
    for (i = 0; i < TERRIMP_PATTERN_COUNT; i++)
        if (terrimp_pattern_find(quads, TERRIMP_FORM_LIST, i, &pattern) == TERRIMP_OK &&
            pattern.first_index == first) {
            part->triangle_count = pattern.triangle_count;
            *coarse = i;
            return 1;
        }
    *coarse = 0;
    for (i = 1; i <= strips; i++) {
        *part = terrimpi_terrain_pattern_of(quads, i);
        if (part->first_index == first)
            return 1;
    }
    for (i = 0; i < terrimpi_mip_columns(quads); i++) {
        terrimpi_terrain_pattern all = terrimpi_terrain_rows(quads, i, 0, quads);
        uint32_t row = all.index_count / quads, z0 = (first - all.first_index) / row;
        uint32_t count = command->index_count / row;
        if (z0 >= quads || count - 1u >= quads - z0)
            continue;
        *part = terrimpi_terrain_rows(quads, i, z0, z0 + count);
        return part->first_index == first && part->index_count == command->index_count;
    }
    return 0;
}

TERRIMP_API terrimp_result terrimp_sorted_ground(const terrimp_terrain *terrain,
                                                 const terrimp_ground_command *command,
                                                 const float eye[3],
                                                 uint16_t *indices, size_t capacity,
                                                 uint32_t *count)
{
    terrimpi_sorted_block b;
    terrimp_node n;
    TERRIMPI_REFUSE(!command || !eye || !count, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_terrain_check_node(terrain, command->node, indices));
    TERRIMPI_REFUSE(!terrimpi_finite2(eye[0], eye[2]), TERRIMP_E_NOT_FINITE);
    b.out.quads = terrain->desc.chunk_quads;
    b.out.form = TERRIMP_FORM_LIST;
    b.out.start = b.out.out = indices;
    TERRIMPI_REFUSE(!terrimpi_sorted_find(b.out.quads, command, &b.part, &b.out.pattern),
                    TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(capacity / 3u < b.part.triangle_count, TERRIMP_E_CAPACITY);
    n = terrimpi_tree_node(&terrain->tree, command->node);
    terrimpi_sorted_write(&b, &terrain->tree, &n, eye);
    *count = (uint32_t)(b.out.out - indices);
    return TERRIMP_OK;
}

enum { TERRIMPI_SORTED_WALL = 3, TERRIMPI_SORTED_DONE };

/* The surface of a mesh: its half-edges in lists by the vertex that they start from, and how far
   the way through it has come. */
typedef struct terrimpi_sorted_net {
    const float *xyz, *eye;
    uint16_t *first, *next; /* of a vertex, of a half-edge; 0xffff: none */
    uint16_t *corners;      /* the indices as they were */
    uint16_t *seen, *path;  /* sides of a triangle that were looked across, WALL, or DONE; triangles
                               that wait, each for the next one */
    uint16_t *out;
    uint32_t circles;
} terrimpi_sorted_net;

static uint16_t terrimpi_sorted_end(const terrimpi_sorted_net *net, uint32_t edge)
{
    return net->corners[edge % 3u == 2u ? edge - 2u : edge + 1u];
}

/* Above 0 if the third vertex, or the eye, lies on the side of an edge on which its triangle is;
   the same number with the other sign for the half-edge that runs the other way. */
static float terrimpi_sorted_within(const terrimpi_sorted_net *net, uint32_t edge,
                                    const float at[3])
{
    uint16_t from = net->corners[edge], to = terrimpi_sorted_end(net, edge);
    const float *a = net->xyz + 3u * terrimpi_min_u32(from, to);
    const float *b = net->xyz + 3u * terrimpi_max_u32(from, to);
    float side = (b[2] - a[2]) * (at[0] - a[0]) - (b[0] - a[0]) * (at[2] - a[2]);
    return from < to ? side : -side;
}

/* The triangle beyond a half-edge if it is farther away, as the eye is not beyond it; else
   0xffff. */
static uint32_t terrimpi_sorted_beyond(const terrimpi_sorted_net *net, uint32_t edge)
{
    uint32_t other = net->first[terrimpi_sorted_end(net, edge)];
    if (!(terrimpi_sorted_within(net, edge, net->eye) > 0.0f))
        return 0xffffu;
    while (other != 0xffffu && terrimpi_sorted_end(net, other) != net->corners[edge])
        other = net->next[other];
    return other == 0xffffu ? other : other / 3u;
}

/* Whether the eye is before a triangle's face. */
static int terrimpi_sorted_faces(const terrimpi_sorted_net *net, uint32_t triangle)
{
    const uint16_t *corner = net->corners + 3u * triangle;
    float ab[3], ac[3], to[3], normal[3];
    terrimpi_sub(net->xyz + 3u * corner[1], net->xyz + 3u * corner[0], ab);
    terrimpi_sub(net->xyz + 3u * corner[2], net->xyz + 3u * corner[0], ac);
    terrimpi_sub(net->eye, net->xyz + 3u * corner[0], to);
    terrimpi_cross(ab, ac, normal);
    return terrimpi_dot(normal, to) > 0.0f;
}

/* Enters the half-edges of the surface. Walls have no area as seen from above. */
static void terrimpi_sorted_net_begin(terrimpi_sorted_net *net, uint32_t vertex_count,
                                      uint32_t count)
{
    uint32_t t, e;
    memset(net->first, 0xff, vertex_count * sizeof *net->first);
    for (t = 0; t < count; t++) {
        const float *third = net->xyz + 3u * net->corners[3u * t + 2u];
        net->seen[t] = terrimpi_sorted_within(net, 3u * t, third) > 0.0f ? 0 : TERRIMPI_SORTED_WALL;
        for (e = 3u * t; e < 3u * t + 3u && net->seen[t] == 0; e++) {
            net->next[e] = net->first[net->corners[e]];
            net->first[net->corners[e]] = (uint16_t)e;
        }
    }
}

/* Writes a triangle after all that have to come before it; one that waits for itself does not. */
static void terrimpi_sorted_write_triangle(terrimpi_sorted_net *net, uint32_t triangle)
{
    uint32_t waiting = 1;
    net->path[0] = (uint16_t)triangle;
    while (waiting > 0) {
        uint32_t t = net->path[waiting - 1u], other;
        if (net->seen[t] == TERRIMPI_SORTED_WALL) { /* or all sides */
            memcpy(net->out, net->corners + 3u * t, 3u * sizeof *net->out);
            net->out += 3;
            net->seen[t] = TERRIMPI_SORTED_DONE;
            waiting--;
            continue;
        }
        other = terrimpi_sorted_beyond(net, 3u * t + net->seen[t]++);
        if (other != 0xffffu && net->seen[other] == 0)
            net->path[waiting++] = (uint16_t)other;
        else if (other != 0xffffu && net->seen[other] != TERRIMPI_SORTED_DONE)
            net->circles++;
    }
}

TERRIMP_API terrimp_result terrimp_sorted_mesh(const float *xyz, uint32_t vertex_count,
                                               const float eye[3], uint16_t *indices,
                                               uint32_t index_count, uint16_t *scratch,
                                               uint32_t *circles)
{
    terrimpi_sorted_net net;
    uint32_t count = index_count / 3u, turn, i;
    TERRIMPI_REFUSE(!xyz || !eye || !indices || !scratch, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(eye), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(index_count % 3u != 0 || index_count > 65535u || vertex_count > 65535u,
                    TERRIMP_E_RANGE);
    for (i = 0; i < index_count; i++)
        TERRIMPI_REFUSE(indices[i] >= vertex_count, TERRIMP_E_RANGE);
    net.xyz = xyz;
    net.eye = eye;
    net.first = scratch;
    net.next = net.first + vertex_count;
    net.corners = net.next + index_count;
    net.seen = net.corners + index_count;
    net.path = net.seen + count;
    net.out = indices;
    net.circles = 0;
    memcpy(net.corners, indices, index_count * sizeof *indices);
    terrimpi_sorted_net_begin(&net, vertex_count, count);
    for (turn = 0; turn < 3; turn++) /* walls that face away, the surface, the other walls */
        for (i = 0; i < count; i++)
            if (net.seen[i] == (turn == 1 ? 0 : TERRIMPI_SORTED_WALL) &&
                (turn > 0 || !terrimpi_sorted_faces(&net, i)))
                terrimpi_sorted_write_triangle(&net, i);
    if (circles)
        *circles = net.circles;
    return TERRIMP_OK;
}

/* ==== Layers ============================================================= >>impl-layers */
/* Based on: Jeschke 2004, chapter 3. With the reference point on the cell's near side each of his
   spacings is an affine step of 1 / depth, so that the n-th layer needs no sum over those before
   it, and depths of thousands of layers do not drift. */

/* 1 / depth after `count` steps d -> d - (shrink d + shift). Steps are doubled as powers are; what
   they take off is kept apart, where 1 - shrink would lose its digits, and taken off at once. */
static float terrimpi_layer_walk(float d, float shrink, float shift, uint32_t count)
{
    float shrinks = 0.0f, shifts = 0.0f;
    for (; count > 0; count >>= 1) {
        if (count & 1u) {
            shrinks += shrink - shrink * shrinks;
            shifts += shift - shrink * shifts;
        }
        shift *= 2.0f - shrink;
        shrink *= 2.0f - shrink;
    }
    return d - (shrinks * d + shifts);
}

/* 1 / depth of a layer; the last one stands no farther than it must. */
static float terrimpi_layer_inverse(const terrimp_layers *l, uint32_t layer)
{
    uint32_t even = terrimpi_min_u32(layer, l->even_count);
    float d = l->first - (float)even * l->step;
    if (layer + 1u >= l->count)
        return l->last;
    return terrimpi_layer_walk(d, l->shrink, l->shift, layer - even);
}

TERRIMP_API float terrimp_layer_depth(const terrimp_layers *layers, uint32_t layer)
{
    return 1.0f / terrimpi_layer_inverse(layers, layer);
}

TERRIMP_API float terrimp_layer_border(const terrimp_layers *layers, uint32_t layer)
{
    if (layer == 0)
        return layers->start;
    if (layer >= layers->count)
        return layers->end;
    return 2.0f / (terrimpi_layer_inverse(layers, layer - 1u) +
                   terrimpi_layer_inverse(layers, layer));
}

TERRIMP_API uint32_t terrimp_layer_of(const terrimp_layers *layers, float depth)
{
    uint32_t low = 0, high = layers->count - 1u;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2u;
        if (depth < terrimp_layer_border(layers, middle + 1u))
            high = middle;
        else
            low = middle + 1u;
    }
    return low;
}

/* The world position of a point (u, v) of the picture, in texels, at a depth. */
static void terrimpi_layer_point(const terrimp_capture *p, float texel, float u, float v,
                                 float depth, float out[3])
{
    float right = (p->tan_left + u * texel) * depth, up = (p->tan_down + v * texel) * depth;
    int k;
    for (k = 0; k < 3; k++)
        out[k] = p->eye[k] + right * p->right[k] + up * p->up[k] + depth * p->forward[k];
}

TERRIMP_API terrimp_result terrimp_layer_corners(const terrimp_layers *layers,
                                                 const terrimp_capture *picture,
                                                 const terrimp_layer_quad *quad,
                                                 const uint32_t atlas[2], float xyz[12],
                                                 float st[8])
{
    float depth;
    uint32_t i;
    TERRIMPI_REFUSE(!layers || !picture || !quad || !atlas || !xyz, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(quad->layer >= layers->count || !atlas[0] || !atlas[1], TERRIMP_E_RANGE);
    depth = terrimp_layer_depth(layers, quad->layer);
    for (i = 0; i < 4u; i++) {
        uint32_t x = i == 1u || i == 2u ? quad->texels.width : 0u;
        uint32_t y = i >= 2u ? quad->texels.height : 0u;
        terrimpi_layer_point(picture, layers->texel, (float)(quad->texels.x + x),
                             (float)(quad->texels.y + y), depth, xyz + 3u * i);
        if (!st)
            continue;
        st[2u * i] = (float)(quad->x + x) / (float)atlas[0];
        st[2u * i + 1u] = (float)(quad->y + y) / (float)atlas[1];
    }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_depth_points(const terrimp_layers *layers,
                                                const terrimp_capture *picture,
                                                const terrimp_depth_vertex *vertices,
                                                uint32_t count, float *xyz)
{
    uint32_t i;
    TERRIMPI_REFUSE(!layers || !picture || !vertices || !xyz, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!layers->count, TERRIMP_E_RANGE);
    for (i = 0; i < count; i++) {
        float last = (float)(layers->count - 1u);
        float layer = terrimpi_min(terrimpi_max(vertices[i].layer, 0.0f), last), d;
        uint32_t k = (uint32_t)layer;
        d = terrimpi_layer_inverse(layers, k);
        if (layer > (float)k) /* between two layers 1 / depth is what goes on evenly */
            d += (layer - (float)k) * (terrimpi_layer_inverse(layers, k + 1u) - d);
        terrimpi_layer_point(picture, layers->texel, vertices[i].u, vertices[i].v, 1.0f / d,
                             xyz + (size_t)3 * i);
    }
    return TERRIMP_OK;
}

/* ==== stop here if you only draw what has been built ====================== */

#ifndef TERRIMP_NO_BUILD

/* ==== Simplifier ========================================================= >>impl-simplifier */
/* Based on: W. Hess, Terrain Impostors, 2010, section 3.1 (half-edge collapses under the rules of
   fig. 3.2, vertical error against the samples a triangle stands for, fixed budget); section 4.2
   (skirts).

   The stages, and what each is worth: means over 1446 chunks of real tiles, 84 triangles, in % of a
   chunk's height range, on one 2 GHz core (tests/bench_simplifier.c):
     collapses alone, vertices at their samples             max 18.1  rms 3.62  0.31 ms
     + heights fitted by least squares                      max 16.2  rms 3.27  0.46 ms
     + the survivor of a collapse moved to its best place   max 15.4  rms 3.00  0.56 ms
     + flips and moves at the end, a start at the extremes  max 13.7  rms 2.67  0.62 ms

   What makes it quick: collapses, flips and moves visit no single samples. The squared error of a
   plane over a set of samples follows from ten sums over that set, and the sums over a triangle are
   those left of its edges, added and subtracted. An edge costs one step a row, thanks to running
   sums along the rows. All of them are integers, so that subtracting loses nothing. */

/* Heights are worked with in steps, of which a tile's range has twice TERRIMPI_SIMP_STEPS: few
   enough that the sums of a row fit 32 bits, so fine that the rounding is under 0.01 % rms. */
#define TERRIMPI_SIMP_STEPS 2047

/* Tenths of vertices inside the start mesh for each one inside the final mesh. More are better and
   slower: 20 gives rms 2.83 %, 25 gives 2.73 %, 35 gives 2.64 % in 1.14 times the time. */
#define TERRIMPI_SIMP_START_TENTHS 30

/* Fans that a collapse is priced by, of those that miss the removed vertex least. All of them
   together gain nothing over 3, and 2 lose less than they save. */
#define TERRIMPI_SIMP_FANS 2

#define TERRIMPI_SIMP_ROUNDS 4             /* of flips and moves on the final mesh */
#define TERRIMPI_SIMP_MOVE_LIMIT 8.0f      /* a move goes so many samples at most */
#define TERRIMPI_SIMP_GAIN 0.9999f         /* only a gain of more than rounding counts as a gain */
#define TERRIMPI_SIMP_MAX_DEGREE 16        /* most triangles round a vertex that changes */
#define TERRIMPI_SIMP_MAX_STEPS 1048576.0f /* of a border height: all sums stay within 64 bits */

/* Sums over the samples of a row before this one: of h, h x and h h. */
typedef struct terrimpi_simp_row_prefix {
    int32_t h, hx, hh;
} terrimpi_simp_row_prefix;

/* Sums over a set of samples (x, z, h). */
enum {
    TERRIMPI_SIMP_SUM_1 = 0,
    TERRIMPI_SIMP_SUM_X,
    TERRIMPI_SIMP_SUM_Z,
    TERRIMPI_SIMP_SUM_XX,
    TERRIMPI_SIMP_SUM_XZ,
    TERRIMPI_SIMP_SUM_ZZ,
    TERRIMPI_SIMP_SUM_H,
    TERRIMPI_SIMP_SUM_HX,
    TERRIMPI_SIMP_SUM_HZ,
    TERRIMPI_SIMP_SUM_HH,
    TERRIMPI_SIMP_SUM_COUNT
};
typedef struct terrimpi_simp_moments {
    int64_t of[TERRIMPI_SIMP_SUM_COUNT];
} terrimpi_simp_moments;

/* Squared error as a function of one vertex's height ref + d: c - 2 b d + a d^2. */
typedef struct terrimpi_simp_quadric {
    float a, b, c;
} terrimpi_simp_quadric;

/* Where columns and rows of a tile really lie, when the last ones lie closer to those before them
   than the others: column x at x * step, but the last one at last_x. A triangle that faces up on
   the tile's even grid need not do so there; the mesh has to face up on both. */
typedef struct terrimpi_simp_last_spacing {
    int32_t step, last_x, last_z;
} terrimpi_simp_last_spacing;

/* The mesh at work. Half-edge 4 t + k (k = 0, 1, 2) is side k of triangle t; it runs from origin[]
   to the origin of the next one, counter-clockwise. The border's vertices come first. */
typedef struct terrimpi_simplifier {
    int32_t cols, rows;
    float middle, unit;     /* height = middle + unit * steps */
    const terrimpi_simp_last_spacing *squeeze; /* NULL: none */
    terrimpi_simp_row_prefix *row_sums; /* [rows][cols] */

    int32_t border_count, vertex_count, triangle_count;
    int32_t half_edge_end, edge_count;
    int32_t *x, *z;         /* [vertex] sample */
    float *height;          /* [vertex] in steps */
    int32_t *out_edge;      /* [vertex] a half-edge that leaves it; -1: the vertex is gone */
    float *cost;            /* [vertex] rise of the squared error when it is collapsed */
    int32_t *target;        /* [vertex] the neighbour that it is best collapsed on to, or -1 */
    uint8_t *stale;         /* [vertex] cost and target are out of date */
    int32_t *origin;        /* [half-edge] the vertex it leaves; -1: the triangle is gone */
    int32_t *twin;          /* [half-edge] the same edge in the next triangle; -1: border */
    int32_t *edge;          /* [half-edge] the edge's number */
    float *square;          /* [triangle] squared error, negative when not known */
    terrimpi_simp_moments *sums;    /* [edge] over the samples left (-x) of the edge, in its rows */
    terrimpi_simp_moments *spare;   /* [TERRIMPI_SIMP_MAX_DEGREE^2] edges under trial */
} terrimpi_simplifier;

static int32_t terrimpi_simp_next(int32_t e) { return (e & 3) == 2 ? e - 2 : e + 1; }
static int32_t terrimpi_simp_prev(int32_t e) { return (e & 3) == 0 ? e + 2 : e - 1; }

static int32_t terrimpi_simp_round(float v) { return (int32_t)(v + (v < 0.0f ? -0.5f : 0.5f)); }

/* Twice the area of a triangle in the xz grid; positive exactly when its normal has y > 0. */
static int32_t terrimpi_simp_area(const terrimpi_simplifier *s, int32_t a, int32_t b, int32_t c)
{
    int32_t bx = s->x[b] - s->x[a], bz = s->z[b] - s->z[a];
    int32_t cx = s->x[c] - s->x[a], cz = s->z[c] - s->z[a];
    return bz * cx - bx * cz;
}

/* Where a vertex really lies. */
static void terrimpi_simp_true_place(const terrimpi_simplifier *s, int32_t v, int64_t place[2])
{
    const terrimpi_simp_last_spacing *squeeze = s->squeeze;
    place[0] = s->x[v] == s->cols - 1 ? squeeze->last_x : s->x[v] * squeeze->step;
    place[1] = s->z[v] == s->rows - 1 ? squeeze->last_z : s->z[v] * squeeze->step;
}

/* Does a triangle face up, on the tile's grid and where its corners really lie? */
static int terrimpi_simp_faces_up(const terrimpi_simplifier *s, int32_t a, int32_t b, int32_t c)
{
    int64_t p[3][2];
    if (terrimpi_simp_area(s, a, b, c) <= 0)
        return 0;
    if (!s->squeeze)
        return 1;
    terrimpi_simp_true_place(s, a, p[0]);
    terrimpi_simp_true_place(s, b, p[1]);
    terrimpi_simp_true_place(s, c, p[2]);
    return terrimpi_twice_area(p[0], p[1], p[2]) > 0;
}

/* --- which samples belong to a triangle, and sums over them --- */

/* Walks an edge down its rows: at >> 20 is the first column at or right of the edge in row z, and
   each row adds `slope`. Exact, although slope is rounded down: an edge that passes beside a sample
   does so by at least 1 / 256 of a column, far more than the rounding of 256 rows together. A
   sample on an edge goes to the right, and on a level edge down; so every sample but those of the
   last row and the last column belongs to exactly one triangle. */
typedef struct terrimpi_simp_edge_step {
    int32_t at, slope, z, end;
} terrimpi_simp_edge_step;

static terrimpi_simp_edge_step terrimpi_simp_edge_stepper(int32_t x0, int32_t z0, int32_t x1,
                                                          int32_t z1)
{
    int upwards = z0 > z1;
    int32_t rows = upwards ? z0 - z1 : z1 - z0, x = upwards ? x1 : x0;
    int32_t run = (upwards ? x0 - x1 : x1 - x0) * (1 << 20);
    terrimpi_simp_edge_step w;
    w.z = upwards ? z1 : z0;
    w.end = w.z + rows;
    w.at = x * (1 << 20) + (1 << 20) - 1;
    w.slope = 0;
    if (rows > 0)
        w.slope = (run < 0 ? run - rows + 1 : run) / rows; /* rounds down */
    return w;
}

/* Columns [left, right) of each row of [low, high) that belong to a triangle. */
typedef struct terrimpi_simp_span {
    int32_t low, high;
    int16_t left[TERRIMP_MAX_TILE_DIM], right[TERRIMP_MAX_TILE_DIM];
} terrimpi_simp_span;

static void terrimpi_simp_find_span(const terrimp_mesh_vertex corner[3], terrimpi_simp_span *span)
{
    int32_t k;
    span->low = span->high = corner[0].z;
    for (k = 0; k < 3; k++) {
        const terrimp_mesh_vertex *p = corner + k, *q = corner + (k + 1) % 3;
        int16_t *side = p->z < q->z ? span->left : span->right;
        terrimpi_simp_edge_step w = terrimpi_simp_edge_stepper(p->x, p->z, q->x, q->z);
        span->low = w.z < span->low ? w.z : span->low;
        span->high = w.end > span->high ? w.end : span->high;
        for (; w.z < w.end; w.z++, w.at += w.slope)
            side[w.z] = (int16_t)(w.at >> 20);
    }
}

/* Sums over the samples left of the edge between (x, z) and vertex b. */
static void terrimpi_simp_edge_moments(const terrimpi_simplifier *s, int32_t x, int32_t z,
                                       int32_t b, terrimpi_simp_moments *out)
{
    terrimpi_simp_edge_step w = terrimpi_simp_edge_stepper(x, z, s->x[b], s->z[b]);
    const terrimpi_simp_row_prefix *row = s->row_sums + w.z * s->cols;
    int32_t n = 0, sx = 0, sh = 0;
    int64_t sxx = 0, shx = 0, shh = 0, end = w.end;
    int64_t n1 = 0, n2 = 0, sx1 = 0, sh1 = 0; /* sums of the sums so far: rows to the end count */
    for (; w.z < w.end; w.z++, w.at += w.slope, row += s->cols) {
        int32_t count = w.at >> 20;
        const terrimpi_simp_row_prefix *sum = row + count;
        int32_t to_x = count * (count - 1) >> 1; /* 0 + 1 + ... + (count - 1) */
        n += count;
        n1 += n;
        n2 += n1;
        sx += to_x;
        sx1 += sx;
        sxx += to_x * (2 * count - 1); /* three times the squares */
        sh += sum->h;
        sh1 += sh;
        shx += sum->hx;
        shh += sum->hh;
    }
    out->of[TERRIMPI_SIMP_SUM_1] = n;
    out->of[TERRIMPI_SIMP_SUM_X] = sx;
    out->of[TERRIMPI_SIMP_SUM_Z] = end * n - n1;
    out->of[TERRIMPI_SIMP_SUM_XX] = sxx / 3;
    out->of[TERRIMPI_SIMP_SUM_XZ] = end * sx - sx1;
    out->of[TERRIMPI_SIMP_SUM_ZZ] = end * (end * n - 2 * n1) + 2 * n2 - n1;
    out->of[TERRIMPI_SIMP_SUM_H] = sh;
    out->of[TERRIMPI_SIMP_SUM_HX] = shx;
    out->of[TERRIMPI_SIMP_SUM_HZ] = end * sh - sh1;
    out->of[TERRIMPI_SIMP_SUM_HH] = shh;
}

/* Sums over triangle abc from those of its edges, which rise in z by the given amounts: a rising
   edge has the triangle on its right, a falling one on its left. No branch, as the signs cannot be
   foretold; a level edge has empty sums. */
static void terrimpi_simp_sides_moments(const terrimpi_simp_moments *ab, int32_t ab_rise,
                                        const terrimpi_simp_moments *bc,
                                        int32_t bc_rise, const terrimpi_simp_moments *ca,
                                        int32_t ca_rise, terrimpi_simp_moments *out)
{
    int64_t f = -(int64_t)(ab_rise > 0), g = -(int64_t)(bc_rise > 0), h = -(int64_t)(ca_rise > 0);
    int i;
    for (i = 0; i < TERRIMPI_SIMP_SUM_COUNT; i++)
        out->of[i] = ((ab->of[i] ^ f) - f) + ((bc->of[i] ^ g) - g) + ((ca->of[i] ^ h) - h);
}

static void terrimpi_simp_triangle_moments(const terrimpi_simplifier *s, int32_t e,
                                           terrimpi_simp_moments *out)
{
    int32_t e1 = terrimpi_simp_next(e), e2 = terrimpi_simp_prev(e);
    int32_t az = s->z[s->origin[e]], bz = s->z[s->origin[e1]], cz = s->z[s->origin[e2]];
    terrimpi_simp_sides_moments(s->sums + s->edge[e], bz - az, s->sums + s->edge[e1], cz - bz,
                                s->sums + s->edge[e2], az - cz, out);
}

/* Works out the sums of a half-edge's edge after an end has moved. */
static void terrimpi_simp_update_edge(terrimpi_simplifier *s, int32_t e)
{
    int32_t a = s->origin[e];
    terrimpi_simp_edge_moments(s, s->x[a], s->z[a], s->origin[terrimpi_simp_next(e)],
                               s->sums + s->edge[e]);
}

/* --- squared errors from sums --- */

/* The sums of a triangle abc about its corner a and the height ref, and its plane when a stands at
   ref: slopes gx, gz. The weight of a falls from 1 at a with the slopes wx, wz. */
typedef struct terrimpi_simp_local {
    float n, x, z, xx, xz, zz, h, hx, hz, hh;
    float gx, gz, wx, wz;
    terrimpi_simp_quadric own; /* of the triangle alone, by the height of a */
} terrimpi_simp_local;

static void terrimpi_simp_recentre(const terrimpi_simplifier *s, const terrimpi_simp_moments *sums,
                                   int32_t a,
                                   int32_t b, int32_t c, int32_t ref, terrimpi_simp_local *l)
{
    const int64_t *of = sums->of;
    int32_t ox = s->x[a], oz = s->z[a];
    int32_t bx = s->x[b] - ox, bz = s->z[b] - oz, cx = s->x[c] - ox, cz = s->z[c] - oz;
    int64_t x = of[TERRIMPI_SIMP_SUM_X] - ox * of[TERRIMPI_SIMP_SUM_1];
    int64_t z = of[TERRIMPI_SIMP_SUM_Z] - oz * of[TERRIMPI_SIMP_SUM_1];
    int64_t h = of[TERRIMPI_SIMP_SUM_H] - ref * of[TERRIMPI_SIMP_SUM_1];
    float inverse = 1.0f / (float)(bz * cx - bx * cz);
    float hb = (s->height[b] - (float)ref) * inverse, hc = (s->height[c] - (float)ref) * inverse;
    l->n = (float)of[TERRIMPI_SIMP_SUM_1];
    l->x = (float)x;
    l->z = (float)z;
    l->xx = (float)(of[TERRIMPI_SIMP_SUM_XX] - ox * (of[TERRIMPI_SIMP_SUM_X] + x));
    l->xz = (float)(of[TERRIMPI_SIMP_SUM_XZ] - ox * of[TERRIMPI_SIMP_SUM_Z] - oz * x);
    l->zz = (float)(of[TERRIMPI_SIMP_SUM_ZZ] - oz * (of[TERRIMPI_SIMP_SUM_Z] + z));
    l->h = (float)h;
    l->hx = (float)(of[TERRIMPI_SIMP_SUM_HX] - ox * of[TERRIMPI_SIMP_SUM_H] - ref * x);
    l->hz = (float)(of[TERRIMPI_SIMP_SUM_HZ] - oz * of[TERRIMPI_SIMP_SUM_H] - ref * z);
    l->hh = (float)(of[TERRIMPI_SIMP_SUM_HH] - ref * (of[TERRIMPI_SIMP_SUM_H] + h));
    l->gx = (float)bz * hc - (float)cz * hb;
    l->gz = (float)cx * hb - (float)bx * hc;
    l->wx = (float)(cz - bz) * inverse;
    l->wz = (float)(bx - cx) * inverse;
}

/* Squared error over triangle abc. */
static float terrimpi_simp_square_error(const terrimpi_simplifier *s,
                                        const terrimpi_simp_moments *sums,
                                        int32_t a, int32_t b, int32_t c)
{
    int32_t ref = terrimpi_simp_round(s->height[a]);
    float d = s->height[a] - (float)ref, gx, gz;
    terrimpi_simp_local l;
    terrimpi_simp_recentre(s, sums, a, b, c, ref, &l);
    gx = l.gx + d * l.wx;
    gz = l.gz + d * l.wz;
    return l.hh + gx * (gx * l.xx + 2.0f * (gz * l.xz - l.hx)) + gz * (gz * l.zz - 2.0f * l.hz) +
           d * (d * l.n + 2.0f * (gx * l.x + gz * l.z - l.h));
}

/* Finds the squared error over triangle abc as a function of a's height, and adds it. */
static void terrimpi_simp_add_triangle(terrimpi_simp_local *l, terrimpi_simp_quadric *p)
{
    float ux = l->gx * l->xx + l->gz * l->xz, uz = l->gx * l->xz + l->gz * l->zz;
    l->own.a = l->n + 2.0f * (l->wx * l->x + l->wz * l->z) +
               l->wx * (l->wx * l->xx + 2.0f * l->wz * l->xz) + l->wz * l->wz * l->zz;
    l->own.b = l->h + l->wx * (l->hx - ux) + l->wz * (l->hz - uz) - l->gx * l->x - l->gz * l->z;
    l->own.c = l->hh + l->gx * (ux - 2.0f * l->hx) + l->gz * (uz - 2.0f * l->hz);
    p->a += l->own.a;
    p->b += l->own.b;
    p->c += l->own.c;
}

/* --- the triangles round an inner vertex --- */

/* The triangles round an inner vertex, counter-clockwise: half-edges that leave it, and the
   vertices where those end. No triangles when there are more than TERRIMPI_SIMP_MAX_DEGREE. */
typedef struct terrimpi_simp_ring {
    int32_t count;
    int32_t spoke[TERRIMPI_SIMP_MAX_DEGREE];
    int32_t vertex[TERRIMPI_SIMP_MAX_DEGREE];
} terrimpi_simp_ring;

static int32_t terrimpi_simp_ring_next(const terrimpi_simp_ring *ring, int32_t i)
{
    return i + 1 < ring->count ? i + 1 : 0;
}

static void terrimpi_simp_find_ring(const terrimpi_simplifier *s, int32_t v,
                                    terrimpi_simp_ring *ring)
{
    int32_t e = s->out_edge[v], n = 0;
    do {
        if (n == TERRIMPI_SIMP_MAX_DEGREE) {
            n = 0;
            break;
        }
        ring->spoke[n] = e;
        ring->vertex[n++] = s->origin[terrimpi_simp_next(e)];
        e = s->twin[terrimpi_simp_prev(e)];
    } while (e != s->out_edge[v]);
    ring->count = n;
}

/* Squared error of the triangle of half-edge e, worked out when it is not known. */
static float terrimpi_simp_triangle_error(terrimpi_simplifier *s, int32_t e)
{
    float *square = s->square + (e >> 2);
    if (*square < 0.0f) {
        terrimpi_simp_moments sums;
        terrimpi_simp_triangle_moments(s, e, &sums);
        *square = terrimpi_max(0.0f, terrimpi_simp_square_error(s, &sums, s->origin[e],
                                                                s->origin[terrimpi_simp_next(e)],
                                                                s->origin[terrimpi_simp_prev(e)]));
    }
    return *square;
}

/* Forgets the errors of a ring's triangles. */
static void terrimpi_simp_forget_errors(terrimpi_simplifier *s, const terrimpi_simp_ring *ring)
{
    int32_t i;
    for (i = 0; i < ring->count; i++)
        s->square[ring->spoke[i] >> 2] = -1.0f;
}

/* Squared error round v as a function of its height, and what it is made of, by triangle. */
static terrimpi_simp_quadric
terrimpi_simp_ring_error(const terrimpi_simplifier *s, int32_t v, const terrimpi_simp_ring *ring,
                         int32_t ref, terrimpi_simp_local part[TERRIMPI_SIMP_MAX_DEGREE])
{
    terrimpi_simp_quadric p = {0.0f, 0.0f, 0.0f};
    int32_t i;
    for (i = 0; i < ring->count; i++) {
        int32_t j = terrimpi_simp_ring_next(ring, i);
        terrimpi_simp_moments sums;
        terrimpi_simp_triangle_moments(s, ring->spoke[i], &sums);
        terrimpi_simp_recentre(s, &sums, v, ring->vertex[i], ring->vertex[j], ref, part + i);
        terrimpi_simp_add_triangle(part + i, &p);
    }
    return p;
}

/* Gives v the height that fits best while its neighbours hold still. */
static void terrimpi_simp_fit_height(terrimpi_simplifier *s, int32_t v)
{
    int32_t ref = terrimpi_simp_round(s->height[v]);
    terrimpi_simp_local part[TERRIMPI_SIMP_MAX_DEGREE];
    terrimpi_simp_quadric p;
    terrimpi_simp_ring ring;
    terrimpi_simp_find_ring(s, v, &ring);
    p = terrimpi_simp_ring_error(s, v, &ring, ref, part);
    if (p.a > 0.0f)
        s->height[v] = (float)ref + p.b / p.a;
    terrimpi_simp_forget_errors(s, &ring);
}

/* One sweep of Gauss and Seidel's least squares over all inner heights. One is enough, as every
   move fits heights too: more change the rms in the fourth digit. */
static void terrimpi_simp_fit_all(terrimpi_simplifier *s)
{
    int32_t v;
    for (v = s->border_count; v < s->vertex_count; v++)
        if (s->out_edge[v] >= 0)
            terrimpi_simp_fit_height(s, v);
}

/* --- moves --- */

/* Stands v on another sample if that keeps the cover and lowers *error, the squared error round v
   at its best height. */
static int terrimpi_simp_try_move(terrimpi_simplifier *s, int32_t v, const terrimpi_simp_ring *ring,
                                  int32_t x, int32_t z, float *error)
{
    int32_t old_x = s->x[v], old_z = s->z[v], ref = terrimpi_simp_round(s->height[v]);
    int32_t n = ring->count, i, j;
    terrimpi_simp_quadric p = {0.0f, 0.0f, 0.0f};
    if (x <= 0 || z <= 0 || x >= s->cols - 1 || z >= s->rows - 1)
        return 0;
    s->x[v] = x;
    s->z[v] = z;
    for (i = 0, j = n - 1; i < n && terrimpi_simp_faces_up(s, v, ring->vertex[j],
                                                           ring->vertex[i]); i++)
        j = i;
    if (i == n)
        for (i = 0; i < n; i++)
            terrimpi_simp_edge_moments(s, x, z, ring->vertex[i], s->spare + i);
    else
        n = i = 0;
    /* a part of the triangles that is already worse ends the trial */
    for (j = n - 1, i = 0; i < n && !(p.c * p.a - p.b * p.b > *error * p.a); j = i++) {
        int32_t b = ring->vertex[j], c = ring->vertex[i];
        terrimpi_simp_moments sums;
        terrimpi_simp_local l;
        terrimpi_simp_sides_moments(s->spare + j, s->z[b] - z,
                                    s->sums + s->edge[terrimpi_simp_next(ring->spoke[j])],
                                    s->z[c] - s->z[b], s->spare + i, z - s->z[c], &sums);
        terrimpi_simp_recentre(s, &sums, v, b, c, ref, &l);
        terrimpi_simp_add_triangle(&l, &p);
    }
    if (n > 0 && i == n && p.a > 0.0f && p.c - p.b * (p.b / p.a) < *error) {
        *error = p.c - p.b * (p.b / p.a);
        s->height[v] = (float)ref + p.b / p.a;
        for (i = 0; i < n; i++)
            s->sums[s->edge[ring->spoke[i]]] = s->spare[i];
        return 1;
    }
    s->x[v] = old_x;
    s->z[v] = old_z;
    return 0;
}

/* Fits v's height and finds the way (dx, dz) to where the error round it would be least, by one
   step of Gauss and Newton: to first order a move adds weight * (gx dx + gz dz) to the residual of
   a sample, where weight is v's share in it and gx, gz are the slopes of its triangle. Returns the
   squared error round v as it stands, or -1 when no way can be told. */
static float terrimpi_simp_newton_step(terrimpi_simplifier *s, int32_t v,
                                       const terrimpi_simp_ring *ring, float *dx, float *dz)
{
    int32_t ref = terrimpi_simp_round(s->height[v]), i;
    terrimpi_simp_local part[TERRIMPI_SIMP_MAX_DEGREE];
    terrimpi_simp_quadric p = terrimpi_simp_ring_error(s, v, ring, ref, part);
    float xx = 0.0f, xz = 0.0f, zz = 0.0f, xh = 0.0f, zh = 0.0f, rx = 0.0f, rz = 0.0f, d, det;
    if (!(p.a > 0.0f))
        return -1.0f;
    d = p.b / p.a;
    s->height[v] = (float)ref + d;
    terrimpi_simp_forget_errors(s, ring);
    for (i = 0; i < ring->count; i++) {
        float gx = part[i].gx + d * part[i].wx, gz = part[i].gz + d * part[i].wz, residual;
        float a = part[i].own.a;
        residual = part[i].own.b - d * a;
        xx += a * gx * gx;
        xz += a * gx * gz;
        zz += a * gz * gz;
        xh += a * gx;
        zh += a * gz;
        rx -= residual * gx;
        rz -= residual * gz;
    }
    xx -= xh * xh / p.a; /* the height follows the move */
    xz -= xh * zh / p.a;
    zz -= zh * zh / p.a;
    d = 0.005f * (xx + zz) + 1e-6f; /* holds back along a crease, where the way is ill told */
    xx += d;
    zz += d;
    det = xx * zz - xz * xz;
    if (!(det > 0.0f))
        return -1.0f;
    *dx = (rx * zz - rz * xz) / det;
    *dz = (rz * xx - rx * xz) / det;
    return p.c - p.b * (p.b / p.a);
}

/* Moves v towards its best place, all the way or half of it. Returns whether it moved. */
static int terrimpi_simp_improve_vertex(terrimpi_simplifier *s, int32_t v)
{
    terrimpi_simp_ring ring;
    float error, dx = 0.0f, dz = 0.0f, length;
    int i;
    terrimpi_simp_find_ring(s, v, &ring);
    error = TERRIMPI_SIMP_GAIN * terrimpi_simp_newton_step(s, v, &ring, &dx, &dz);
    if (!(error > 0.0f))
        return 0;
    length = TERRIMP_SQRTF(dx * dx + dz * dz);
    if (!(length < TERRIMPI_FLOAT_MAX))
        return 0;
    if (length > TERRIMPI_SIMP_MOVE_LIMIT) {
        dx *= TERRIMPI_SIMP_MOVE_LIMIT / length;
        dz *= TERRIMPI_SIMP_MOVE_LIMIT / length;
    }
    for (i = 0; i < 2; i++, dx *= 0.5f, dz *= 0.5f) {
        int32_t to_x = terrimpi_simp_round(dx), to_z = terrimpi_simp_round(dz);
        if (to_x == 0 && to_z == 0)
            return 0;
        if (terrimpi_simp_try_move(s, v, &ring, s->x[v] + to_x, s->z[v] + to_z, &error))
            return 1;
    }
    return 0;
}

/* Moves the vertices of the start mesh, each within its cell of samples, to the highest or the
   lowest one there where that fits better: else a spike between them would be lost, which no later
   step looks for. */
static void terrimpi_simp_seek_extremes(terrimpi_simplifier *s)
{
    float area = (float)(s->cols * s->rows) / (float)(s->vertex_count - s->border_count);
    int32_t v, x, z, k, side = (int32_t)terrimpi_ceil_u32(TERRIMP_SQRTF(area));
    for (v = s->border_count; v < s->vertex_count; v++) {
        int32_t from_x = s->x[v] - side / 2, from_z = s->z[v] - side / 2, at[2][2], best[2];
        float error, dx, dz;
        terrimpi_simp_ring ring;
        best[0] = best[1] = -2 * TERRIMPI_SIMP_STEPS;
        for (z = from_z < 1 ? 1 : from_z; z < from_z + side && z < s->rows - 1; z++)
            for (x = from_x < 1 ? 1 : from_x; x < from_x + side && x < s->cols - 1; x++) {
                const terrimpi_simp_row_prefix *row = s->row_sums + z * s->cols + x;
                int32_t h = row[1].h - row[0].h;
                for (k = 0; k < 2; k++, h = -h)
                    if (h > best[k]) {
                        best[k] = h;
                        at[k][0] = x;
                        at[k][1] = z;
                    }
            }
        terrimpi_simp_find_ring(s, v, &ring);
        error = TERRIMPI_SIMP_GAIN * terrimpi_simp_newton_step(s, v, &ring, &dx, &dz);
        for (k = 0; k < 2 && error > 0.0f; k++)
            terrimpi_simp_try_move(s, v, &ring, at[k][0], at[k][1], &error);
    }
}

/* --- flips --- */

static void terrimpi_simp_link(terrimpi_simplifier *s, int32_t e, int32_t twin, int32_t edge)
{
    s->twin[e] = twin;
    s->edge[e] = edge;
    if (twin >= 0) {
        s->twin[twin] = e;
        s->edge[twin] = edge;
    }
}

/* Finds the corners a, b, c, d of the triangles abc and bad beside half-edge e = ab. Returns
   whether adc and bcd, which have the other diagonal, would face up. */
static int terrimpi_simp_can_flip(const terrimpi_simplifier *s, int32_t e, int32_t v[4])
{
    int32_t f = s->twin[e];
    if (f < 0)
        return 0;
    v[0] = s->origin[e];
    v[1] = s->origin[f];
    v[2] = s->origin[terrimpi_simp_prev(e)];
    v[3] = s->origin[terrimpi_simp_prev(f)];
    return terrimpi_simp_faces_up(s, v[0], v[3], v[2]) && terrimpi_simp_faces_up(s, v[3], v[1],
                                                                                 v[2]);
}

/* Triangles abc (half-edge e = ab) and bad become adc and bcd; `sums` are those of edge cd. */
static void terrimpi_simp_flip(terrimpi_simplifier *s, int32_t e, const terrimpi_simp_moments *sums)
{
    int32_t f = s->twin[e], bc = terrimpi_simp_next(e), ad = terrimpi_simp_next(f);
    int32_t c = s->origin[terrimpi_simp_prev(e)], d = s->origin[terrimpi_simp_prev(f)];
    int32_t flipped = s->edge[e];
    s->out_edge[s->origin[e]] = e;
    s->out_edge[s->origin[f]] = f;
    s->out_edge[c] = ad;
    s->out_edge[d] = bc;
    terrimpi_simp_link(s, e, s->twin[ad], s->edge[ad]);
    terrimpi_simp_link(s, f, s->twin[bc], s->edge[bc]);
    s->origin[ad] = c;
    s->origin[bc] = d;
    terrimpi_simp_link(s, ad, bc, flipped);
    s->sums[flipped] = *sums;
    s->square[e >> 2] = s->square[f >> 2] = -1.0f;
}

/* Flips the edge of e if that lowers the squared error. */
static void terrimpi_simp_try_flip(terrimpi_simplifier *s, int32_t e)
{
    int32_t f = s->twin[e], v[4], az, bz, cz, dz;
    terrimpi_simp_moments sums, fresh;
    float before, after;
    const terrimpi_simp_moments *edge_sums = s->sums;
    if (!terrimpi_simp_can_flip(s, e, v))
        return;
    az = s->z[v[0]];
    bz = s->z[v[1]];
    cz = s->z[v[2]];
    dz = s->z[v[3]];
    before = terrimpi_simp_triangle_error(s, e) + terrimpi_simp_triangle_error(s, f);
    terrimpi_simp_edge_moments(s, s->x[v[2]], cz, v[3], &fresh);
    terrimpi_simp_sides_moments(edge_sums + s->edge[terrimpi_simp_next(f)], dz - az, &fresh,
                                cz - dz,
                                edge_sums + s->edge[terrimpi_simp_prev(e)], az - cz, &sums);
    after = terrimpi_simp_square_error(s, &sums, v[0], v[3], v[2]);
    terrimpi_simp_sides_moments(edge_sums + s->edge[terrimpi_simp_prev(f)], bz - dz,
                                edge_sums + s->edge[terrimpi_simp_next(e)], cz - bz, &fresh,
                                dz - cz, &sums);
    after += terrimpi_simp_square_error(s, &sums, v[3], v[1], v[2]);
    if (after < TERRIMPI_SIMP_GAIN * before)
        terrimpi_simp_flip(s, e, &fresh);
}

static void terrimpi_simp_flip_all(terrimpi_simplifier *s)
{
    int32_t e;
    for (e = 0; e < s->half_edge_end; e++)
        if ((e & 3) != 3 && s->origin[e] >= 0 && s->twin[e] > e)
            terrimpi_simp_try_flip(s, e);
}

/* --- collapses (Hess 3.1) --- */

/* How far v would be left above or below the fan of triangles from corner k of its ring, or a
   negative number when the fan does not cover the ring's polygon one to one, which forbids the
   collapse. Inner vertices alone collapse here, so the outline and the corners stay (fig. 3.2);
   the borders were simplified on their own. */
static float terrimpi_simp_fan_residual(const terrimpi_simplifier *s, int32_t v,
                                        const terrimpi_simp_ring *ring, int32_t k)
{
    int32_t i, a = ring->vertex[k], j, b, c, before = 1;
    float miss = 0.0f;
    j = terrimpi_simp_ring_next(ring, k);
    c = ring->vertex[j];
    for (i = 2; i < ring->count; i++) {
        int32_t area, after;
        j = terrimpi_simp_ring_next(ring, j);
        b = c;
        c = ring->vertex[j];
        area = terrimpi_simp_area(s, a, b, c);
        if (!terrimpi_simp_faces_up(s, a, b, c))
            return -1.0f;
        after = before > 0 ? terrimpi_simp_area(s, a, c, v) : -1;
        if (before > 0 && after <= 0) { /* v lies between ab and ac */
            float wb = (float)-after, wc = (float)terrimpi_simp_area(s, a, b, v);
            float ha = s->height[a];
            miss = ha - s->height[v] +
                   (wb * (s->height[b] - ha) + wc * (s->height[c] - ha)) / (float)area;
            miss = miss < 0.0f ? -miss : miss;
        }
        before = after;
    }
    return miss;
}

/* Sums of the edge between corners k and j of a ring: of the ring's own edge when they are
   neighbours, else worked out once for all fans. */
static const terrimpi_simp_moments *terrimpi_simp_diagonal(const terrimpi_simplifier *s,
                                                           const terrimpi_simp_ring *ring,
                                                           uint32_t *known, int32_t k, int32_t j)
{
    int32_t n = ring->count, low = k < j ? k : j, high = k < j ? j : k;
    terrimpi_simp_moments *sums = s->spare + low * TERRIMPI_SIMP_MAX_DEGREE + high;
    if (high == low + 1)
        return s->sums + s->edge[terrimpi_simp_next(ring->spoke[low])];
    if (low == 0 && high == n - 1)
        return s->sums + s->edge[terrimpi_simp_next(ring->spoke[high])];
    if (!(known[low] & (1u << high))) {
        int32_t v = ring->vertex[low];
        known[low] |= 1u << high;
        terrimpi_simp_edge_moments(s, s->x[v], s->z[v], ring->vertex[high], sums);
    }
    return sums;
}

/* Squared error of the fan from corner k of a ring, or anything from `limit` up. */
static float terrimpi_simp_fan_error(const terrimpi_simplifier *s, const terrimpi_simp_ring *ring,
                                     uint32_t *known, int32_t k, float limit)
{
    int32_t i, a = ring->vertex[k], j = terrimpi_simp_ring_next(ring, k);
    float error = 0.0f;
    for (i = 2; i < ring->count && error < limit; i++) {
        int32_t next = terrimpi_simp_ring_next(ring, j);
        int32_t b = ring->vertex[j], c = ring->vertex[next];
        terrimpi_simp_moments sums;
        terrimpi_simp_sides_moments(terrimpi_simp_diagonal(s, ring, known, k, j), s->z[b] - s->z[a],
                                    terrimpi_simp_diagonal(s, ring, known, j, next),
                                    s->z[c] - s->z[b],
                                    terrimpi_simp_diagonal(s, ring, known, k, next),
                                    s->z[a] - s->z[c], &sums);
        error += terrimpi_simp_square_error(s, &sums, a, b, c);
        j = next;
    }
    return error;
}

/* Finds the best collapse of inner vertex v and its cost. */
static void terrimpi_simp_price(terrimpi_simplifier *s, int32_t v)
{
    uint32_t known[TERRIMPI_SIMP_MAX_DEGREE];
    int32_t fan[TERRIMPI_SIMP_MAX_DEGREE], fans = 0, i, k;
    float miss[TERRIMPI_SIMP_MAX_DEGREE], best = TERRIMPI_FLOAT_MAX;
    terrimpi_simp_ring ring;
    terrimpi_simp_find_ring(s, v, &ring);
    s->stale[v] = 0;
    s->target[v] = -1;
    s->cost[v] = TERRIMPI_FLOAT_MAX;
    memset(known, 0, sizeof known);
    for (k = 0; k < ring.count; k++) { /* sort the fans by what they miss at v itself */
        float m = terrimpi_simp_fan_residual(s, v, &ring, k);
        if (m < 0.0f)
            continue;
        for (i = fans++; i > 0 && miss[i - 1] > m; i--) {
            miss[i] = miss[i - 1];
            fan[i] = fan[i - 1];
        }
        miss[i] = m;
        fan[i] = k;
    }
    for (i = 0; i < fans && i < TERRIMPI_SIMP_FANS; i++) {
        float error = terrimpi_simp_fan_error(s, &ring, known, fan[i], best);
        if (error < best) {
            best = error;
            s->target[v] = ring.vertex[fan[i]];
        }
    }
    if (s->target[v] < 0)
        return;
    s->cost[v] = best;
    for (k = 0; k < ring.count; k++)
        s->cost[v] -= terrimpi_simp_triangle_error(s, ring.spoke[k]);
}

static void terrimpi_simp_drop_triangle(terrimpi_simplifier *s, int32_t e)
{
    s->origin[e] = s->origin[terrimpi_simp_next(e)] = s->origin[terrimpi_simp_prev(e)] = -1;
    s->triangle_count--;
}

/* Collapses inner vertex v on to its neighbour `target`. */
static void terrimpi_simp_collapse(terrimpi_simplifier *s, int32_t v, int32_t target)
{
    terrimpi_simp_ring ring;
    int32_t i, k = 0, n, first, last, after, before;
    terrimpi_simp_find_ring(s, v, &ring);
    n = ring.count;
    while (ring.vertex[k] != target)
        k++;
    for (i = 0; i < n; i++) {
        s->stale[ring.vertex[i]] = 1;
        s->origin[ring.spoke[i]] = target;
    }
    terrimpi_simp_forget_errors(s, &ring);
    /* the triangles on both sides of the collapsed edge close up */
    first = ring.spoke[k];
    last = ring.spoke[(k + n - 1) % n];
    after = ring.spoke[(k + 1) % n];
    before = terrimpi_simp_prev(ring.spoke[(k + n - 2) % n]);
    terrimpi_simp_link(s, after, s->twin[terrimpi_simp_next(first)],
                       s->edge[terrimpi_simp_next(first)]);
    terrimpi_simp_link(s, before, s->twin[terrimpi_simp_next(last)],
                       s->edge[terrimpi_simp_next(last)]);
    terrimpi_simp_drop_triangle(s, first);
    terrimpi_simp_drop_triangle(s, last);
    s->out_edge[v] = -1;
    for (i = 1; i < n - 1; i++) {
        int32_t outer = terrimpi_simp_next(ring.spoke[(k + i) % n]);
        s->out_edge[s->origin[outer]] = outer;
        if (i > 1)
            terrimpi_simp_update_edge(s, ring.spoke[(k + i) % n]);
    }
    s->out_edge[ring.vertex[(k + n - 1) % n]] = before;
    s->out_edge[target] = after;
}

/* Makes some vertex collapsible where none is: turns edges away from it, which is possible until
   three triangles are left or a collapse is. Returns the vertex, -1 when none is left. */
static int32_t terrimpi_simp_force_collapse(terrimpi_simplifier *s)
{
    int32_t v;
    for (v = s->border_count; v < s->vertex_count; v++) {
        int turned = s->out_edge[v] >= 0;
        while (turned) {
            int32_t e = s->out_edge[v];
            terrimpi_simp_price(s, v);
            if (s->target[v] >= 0)
                return v;
            do {
                int32_t corner[4];
                turned = terrimpi_simp_can_flip(s, e, corner);
                if (turned) {
                    terrimpi_simp_moments sums;
                    int32_t c = corner[2], d = corner[3];
                    terrimpi_simp_edge_moments(s, s->x[c], s->z[c], d, &sums);
                    terrimpi_simp_flip(s, e, &sums);
                    s->stale[c] = s->stale[d] = 1;
                    break;
                }
                e = s->twin[terrimpi_simp_prev(e)];
            } while (e != s->out_edge[v]);
        }
    }
    return -1;
}

/* The cheapest vertex whose price is up to date, -1 when none can be collapsed. Prices that went
   stale are looked at again only when they come up: a removal nearby makes them rise as a rule. */
static int32_t terrimpi_simp_cheapest(terrimpi_simplifier *s)
{
    for (;;) {
        int32_t v, best = -1;
        for (v = s->border_count; v < s->vertex_count; v++)
            if (s->out_edge[v] >= 0 && (best < 0 || s->cost[v] < s->cost[best]))
                best = v;
        if (best < 0 || !s->stale[best])
            return best < 0 || s->target[best] >= 0 ? best : terrimpi_simp_force_collapse(s);
        terrimpi_simp_price(s, best);
    }
}

/* Collapses until the budget is met. The vertex that stays is moved to its best place each time. */
static void terrimpi_simp_collapse_to(terrimpi_simplifier *s, int32_t budget)
{
    int32_t v;
    for (v = s->border_count; v < s->vertex_count; v++)
        terrimpi_simp_price(s, v);
    while (s->triangle_count > budget && (v = terrimpi_simp_cheapest(s)) >= 0) {
        int32_t target = s->target[v];
        terrimpi_simp_collapse(s, v, target);
        if (target >= s->border_count && terrimpi_simp_improve_vertex(s, target)) {
            terrimpi_simp_ring ring;
            terrimpi_simp_find_ring(s, target, &ring);
            while (ring.count-- > 0)
                s->stale[ring.vertex[ring.count]] = 1;
        }
    }
}

/* --- moves at the end --- */

/* Flips and moves on the mesh of the final size, then the last fit of the heights. */
static void terrimpi_simp_polish(terrimpi_simplifier *s)
{
    int32_t v, round;
    for (round = 0; round < TERRIMPI_SIMP_ROUNDS; round++) {
        terrimpi_simp_flip_all(s);
        for (v = s->border_count; v < s->vertex_count; v++)
            if (s->out_edge[v] >= 0)
                terrimpi_simp_improve_vertex(s, v);
    }
    terrimpi_simp_flip_all(s);
    terrimpi_simp_fit_all(s);
}

/* --- the start mesh --- */

/* Some vertices in a row: first, first + step, ...; at `wrap` the count begins again at 0. */
typedef struct terrimpi_simp_chain {
    int32_t first, step, count, wrap;
} terrimpi_simp_chain;

static int32_t terrimpi_simp_chain_at(const terrimpi_simp_chain *chain, int32_t i)
{
    int32_t v = chain->first + i * chain->step;
    return v >= chain->wrap ? v - chain->wrap : v;
}

static void terrimpi_simp_add_face(terrimpi_simplifier *s, int32_t a, int32_t b, int32_t c)
{
    int32_t e = s->half_edge_end;
    s->origin[e] = a;
    s->origin[e + 1] = b;
    s->origin[e + 2] = c;
    s->half_edge_end += 4;
    s->triangle_count++;
}

/* Position of the middle between items i and i + 1 of a chain, along a direction. */
static int32_t terrimpi_simp_middle_along(const terrimpi_simplifier *s,
                                          const terrimpi_simp_chain *chain,
                                          int32_t i, int32_t dx, int32_t dz)
{
    int32_t v = terrimpi_simp_chain_at(chain, i), w = terrimpi_simp_chain_at(chain, i + 1);
    return (s->x[v] + s->x[w]) * dx + (s->z[v] + s->z[w]) * dz;
}

/* Fills the strip between two parallel chains that run the same way; seen from above, inner lies
   on the left of outer. Whichever chain steps first, the triangles face up: the chain that is
   behind steps. */
static void terrimpi_simp_zip(terrimpi_simplifier *s, const terrimpi_simp_chain *outer,
                              const terrimpi_simp_chain *inner)
{
    int32_t first = terrimpi_simp_chain_at(outer, 0);
    int32_t last = terrimpi_simp_chain_at(outer, outer->count - 1);
    int32_t dx = s->x[last] - s->x[first], dz = s->z[last] - s->z[first], i = 0, j = 0;
    while (i + 1 < outer->count || j + 1 < inner->count) {
        int32_t o = terrimpi_simp_chain_at(outer, i), n = terrimpi_simp_chain_at(inner, j);
        int step_outer = j + 1 == inner->count;
        if (i + 1 < outer->count && j + 1 < inner->count)
            step_outer = terrimpi_simp_middle_along(s, outer, i, dx, dz) <
                         terrimpi_simp_middle_along(s, inner, j, dx, dz);
        if (step_outer)
            terrimpi_simp_add_face(s, o, terrimpi_simp_chain_at(outer, ++i), n);
        else
            terrimpi_simp_add_face(s, o, terrimpi_simp_chain_at(inner, ++j), n);
    }
}

/* Columns and rows of the start lattice: at most `limit` points (1 if that is 0), in the
   proportions of the inside, none outside. */
static void terrimpi_simp_lattice_size(int32_t inner_cols, int32_t inner_rows, int32_t limit,
                                       int32_t *cols, int32_t *rows)
{
    int32_t c = inner_cols, r = inner_rows;
    limit = limit < 1 ? 1 : limit;
    if (c * r > limit) {
        c = terrimpi_simp_round(TERRIMP_SQRTF((float)limit * (float)inner_cols /
                                              (float)inner_rows));
        c = c < 1 ? 1 : c > inner_cols ? inner_cols : c;
        c = c > limit ? limit : c;
        r = limit / c < inner_rows ? limit / c : inner_rows;
        c = limit / r < inner_cols ? limit / r : inner_cols;
    }
    *cols = c;
    *rows = r;
}

/* Places the border's vertices as a loop, counter-clockwise seen from above from (0, 0) along +z.
   side[i] is where the loop's side i begins. */
static void terrimpi_simp_place_border(terrimpi_simplifier *s, const terrimp_border *borders,
                                       terrimp_mesh_vertex *loop, int32_t side[5])
{
    static const int order[4] = {TERRIMP_SIDE_X0, TERRIMP_SIDE_Z1, TERRIMP_SIDE_X1,
                                 TERRIMP_SIDE_Z0};
    int32_t w = s->cols - 1, h = s->rows - 1, v = 0, i, j;
    float steps;
    for (i = 0; i < 4; i++) {
        const terrimp_border *border = borders + order[i];
        int32_t last = (int32_t)border->point_count - 1;
        side[i] = v;
        for (j = 0; j < last; j++, v++) { /* the end is the beginning of the next side */
            const terrimp_border_point *p = border->points + (i < 2 ? j : last - j);
            s->x[v] = i == 0 ? 0 : i == 2 ? w : p->at;
            s->z[v] = i == 1 ? h : i == 3 ? 0 : p->at;
            steps = (p->height - s->middle) / s->unit;
            steps = terrimpi_min(steps, TERRIMPI_SIMP_MAX_STEPS);
            s->height[v] = terrimpi_max(steps, -TERRIMPI_SIMP_MAX_STEPS);
            loop[v].x = (uint16_t)s->x[v];
            loop[v].z = (uint16_t)s->z[v];
            loop[v].height = p->height;
        }
    }
    side[4] = s->border_count = v;
}

/* Finds the twin of every half-edge, numbers the edges and works out their sums. */
static void terrimpi_simp_join(terrimpi_simplifier *s)
{
    int32_t e, v;
    for (v = 0; v < s->vertex_count; v++)
        s->out_edge[v] = -1;
    for (e = 0; e < s->half_edge_end; e++)
        if ((e & 3) != 3) { /* edge[] serves as a list of the half-edges that leave a vertex */
            s->twin[e] = -1;
            s->edge[e] = s->out_edge[s->origin[e]];
            s->out_edge[s->origin[e]] = e;
        }
    for (e = 0; e < s->half_edge_end; e++)
        if ((e & 3) != 3 && s->twin[e] < 0) {
            int32_t f = s->out_edge[s->origin[terrimpi_simp_next(e)]];
            while (f >= 0 && s->origin[terrimpi_simp_next(f)] != s->origin[e])
                f = s->edge[f];
            s->twin[e] = f;
            if (f >= 0)
                s->twin[f] = e;
        }
    for (e = 0; e < s->half_edge_end; e += 4)
        s->square[e >> 2] = -1.0f;
    s->edge_count = 0;
    for (e = 0; e < s->half_edge_end; e++)
        if ((e & 3) != 3 && s->twin[e] < e) {
            terrimpi_simp_link(s, e, s->twin[e], s->edge_count++);
            terrimpi_simp_update_edge(s, e);
        }
}

/* Fills what lies between the border, whose sides begin at side[], and a lattice of cols x rows
   vertices; without one, the strip from one long side to the other, which runs the other way. */
static void terrimpi_simp_zip_border(terrimpi_simplifier *s, const int32_t side[5], int32_t cols,
                                     int32_t rows)
{
    int32_t v = s->border_count, end = s->vertex_count, i = s->cols > 2 ? 1 : 0;
    const terrimpi_simp_chain lattice[4] = {{v, cols, rows, end},
                                            {v + cols * (rows - 1), 1, cols, end},
                                            {end - 1, -cols, rows, end},
                                            {v + cols - 1, -1, cols, end}};
    const terrimpi_simp_chain border[4] = {{side[0], 1, side[1] - side[0] + 1, v},
                                           {side[1], 1, side[2] - side[1] + 1, v},
                                           {side[2], 1, side[3] - side[2] + 1, v},
                                           {side[3], 1, side[4] - side[3] + 1, v}};
    const terrimpi_simp_chain across = {side[i + 3], -1, border[i + 2].count, v};
    if (cols == 0)
        terrimpi_simp_zip(s, &border[i], &across);
    for (i = 0; i < 4 && cols > 0; i++)
        terrimpi_simp_zip(s, &border[i], &lattice[i]);
}

/* Builds the start mesh: the border polylines round a regular lattice of samples, or round nothing
   where the tile has no inside. Returns whether the lattice holds every inner sample. */
static int terrimpi_simp_start(terrimpi_simplifier *s, const terrimp_simplify_desc *desc,
                               int32_t lattice_limit, terrimp_mesh_vertex *loop)
{
    int32_t w = s->cols - 1, h = s->rows - 1, side[5], cols = 0, rows = 0, i, j, v;
    terrimpi_simp_place_border(s, desc->borders, loop, side);
    if (w > 1 && h > 1)
        terrimpi_simp_lattice_size(w - 1, h - 1, lattice_limit, &cols, &rows);
    v = s->border_count;
    for (j = 1; j <= rows; j++)
        for (i = 1; i <= cols; i++, v++) {
            s->x[v] = (2 * i * w + cols + 1) / (2 * (cols + 1));
            s->z[v] = (2 * j * h + rows + 1) / (2 * (rows + 1));
            s->height[v] = (desc->heights[s->z[v] * s->cols + s->x[v]] - s->middle) / s->unit;
        }
    s->vertex_count = v;
    s->half_edge_end = s->triangle_count = 0;
    terrimpi_simp_zip_border(s, side, cols, rows);
    v = s->border_count;
    for (j = 0; j + 1 < rows; j++)
        for (i = 0; i + 1 < cols; i++) {
            int32_t a = v + j * cols + i;
            terrimpi_simp_add_face(s, a, a + cols, a + cols + 1);
            terrimpi_simp_add_face(s, a, a + cols + 1, a + 1);
        }
    terrimpi_simp_join(s);
    return cols * rows == (w - 1) * (h - 1);
}

/* Range of the tile and the running sums of its samples in steps. */
static void terrimpi_simp_read_samples(terrimpi_simplifier *s, const float *heights)
{
    int32_t count = s->cols * s->rows, i, x, z;
    float low = heights[0], high = heights[0], scale;
    for (i = 1; i < count; i++) {
        low = heights[i] < low ? heights[i] : low;
        high = heights[i] > high ? heights[i] : high;
    }
    s->middle = 0.5f * low + 0.5f * high;
    s->unit = (0.5f * high - 0.5f * low) / (float)TERRIMPI_SIMP_STEPS;
    if (!(s->unit > 1e-30f)) /* flat: any unit will do */
        s->unit = 1.0f;
    scale = 1.0f / s->unit;
    for (z = 0; z < s->rows; z++) {
        const float *in = heights + z * s->cols;
        terrimpi_simp_row_prefix *row = s->row_sums + z * s->cols, sum = {0, 0, 0};
        for (x = 0; x < s->cols; x++) {
            int32_t h = terrimpi_simp_round((in[x] - s->middle) * scale);
            row[x] = sum;
            sum.h += h;
            sum.hx += h * x;
            sum.hh += h * h;
        }
    }
}

/* --- borders --- */

/* Adds the squared error of the samples strictly between a kept point and sample `at`, where the
   polyline has height ref, as a function of that height. */
static void terrimpi_simp_add_slope(const float *heights, const terrimp_border_point *from,
                                    int32_t at, float ref, terrimpi_simp_quadric *p)
{
    int32_t way = from->at < at ? 1 : -1, i, count = (at - from->at) * way;
    float weight = 1.0f / (float)count, slope = (ref - from->height) * weight;
    for (i = 1; i < count; i++) {
        float w = (float)i * weight;
        float r = heights[from->at + i * way] - (from->height + (float)i * slope);
        p->a += w * w;
        p->b += w * r;
        p->c += r * r;
    }
}

/* Squared error between the neighbours of inner point p when it stands on sample `at`. */
static terrimpi_simp_quadric terrimpi_simp_point_error(const float *heights,
                                                       const terrimp_border_point *p,
                                                       int32_t at, float ref)
{
    float r = heights[at] - ref;
    terrimpi_simp_quadric error;
    error.a = 1.0f;
    error.b = r;
    error.c = r * r;
    terrimpi_simp_add_slope(heights, p - 1, at, ref, &error);
    terrimpi_simp_add_slope(heights, p + 1, at, ref, &error);
    return error;
}

/* Squared error between the neighbours of inner point p when it is gone. */
static float terrimpi_simp_gap_error(const float *heights, const terrimp_border_point *p)
{
    terrimpi_simp_quadric error = {0.0f, 0.0f, 0.0f};
    terrimpi_simp_add_slope(heights, p - 1, p[1].at, p[1].height, &error);
    return error.c;
}

/* Moves every inner point to the sample and the height that fit best while its neighbours hold
   still. Returns whether one moved. */
static int terrimpi_simp_improve_border(const float *heights, terrimp_border_point *points,
                                        uint32_t count)
{
    uint32_t i;
    int moved = 0;
    for (i = 1; i + 1 < count; i++) {
        terrimp_border_point *p = points + i;
        int32_t at, best = p->at;
        float ref = p->height, least = TERRIMPI_FLOAT_MAX;
        int32_t end = (p->at + p[1].at) / 2;
        for (at = (p[-1].at + p->at) / 2 + 1; at <= end; at++) {
            terrimpi_simp_quadric error = terrimpi_simp_point_error(heights, p, at, ref);
            float fitted = error.c - error.b * (error.b / error.a);
            if (fitted < least) {
                least = fitted;
                best = at;
                p->height = ref + error.b / error.a;
            }
        }
        moved |= best != p->at;
        p->at = (uint16_t)best;
    }
    return moved;
}

/* Removes inner points, the cheapest first, until `count` points are left in all. */
static void terrimpi_simp_thin_border(const float *heights, terrimp_border_point *points,
                                      uint32_t point_count, uint32_t count)
{
    float cost[TERRIMP_MAX_TILE_DIM];
    uint32_t i;
    for (i = 1; i + 1 < point_count; i++)
        cost[i] = terrimpi_simp_gap_error(heights, points + i);
    while (point_count > count) {
        uint32_t best = 1;
        for (i = 2; i + 1 < point_count; i++)
            if (cost[i] < cost[best])
                best = i;
        point_count--;
        memmove(points + best, points + best + 1, (point_count - best) * sizeof *points);
        memmove(cost + best, cost + best + 1, (point_count - best) * sizeof *cost);
        if (best > 1)
            cost[best - 1] = terrimpi_simp_gap_error(heights, points + best - 1);
        if (best + 1 < point_count)
            cost[best] = terrimpi_simp_gap_error(heights, points + best);
    }
}

TERRIMP_API terrimp_result terrimp_border_simplify(const float *heights, uint32_t count,
                                                   uint32_t inner_limit,
                                                   terrimp_border_point *points,
                                                   uint32_t capacity, uint32_t *point_count)
{
    terrimp_border_point kept[TERRIMP_MAX_TILE_DIM];
    uint32_t i, wanted;
    int round;
    TERRIMPI_REFUSE(!heights || !points || !point_count, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(count < 2 || count > TERRIMP_MAX_TILE_DIM ||
                    inner_limit > TERRIMP_MAX_TILE_DIM, TERRIMP_E_RANGE);
    for (i = 0; i < count; i++) {
        TERRIMPI_REFUSE(!terrimpi_finite(heights[i]), TERRIMP_E_NOT_FINITE);
        kept[i].at = (uint16_t)i;
        kept[i].height = heights[i];
    }
    wanted = (inner_limit ? inner_limit : TERRIMP_BORDER_POINTS) + 2;
    wanted = wanted < count ? wanted : count;
    TERRIMPI_REFUSE(capacity < wanted, TERRIMP_E_CAPACITY);
    if (wanted < count) {
        terrimpi_simp_thin_border(heights, kept, count, wanted);
        for (round = 0; round < 8 && terrimpi_simp_improve_border(heights, kept, wanted); round++) {
        }
    }
    memcpy(points, kept, wanted * sizeof *points);
    *point_count = wanted;
    return TERRIMP_OK;
}

/* --- a tile --- */

/* The numbers that every size follows from; `budget` is never 0. */
typedef struct terrimpi_simp_plan {
    uint32_t cols, rows, budget;
    uint32_t border; /* vertices of the loop; in a size query the largest possible number */
    uint32_t inner;  /* vertices inside the final mesh at most */
    uint32_t lattice; /* vertices inside the start mesh at most */
} terrimpi_simp_plan;

static terrimpi_simp_plan terrimpi_simp_make_plan(uint32_t cols, uint32_t rows, uint32_t budget,
                                                  uint32_t border)
{
    terrimpi_simp_plan plan;
    uint32_t inside = (cols - 2) * (rows - 2);
    plan.cols = cols;
    plan.rows = rows;
    plan.budget = budget ? budget : TERRIMP_TRIANGLE_BUDGET;
    plan.border = border;
    plan.inner = (plan.budget + 2 - border) / 2;
    plan.inner = plan.inner < inside ? plan.inner : inside;
    plan.lattice = TERRIMPI_SIMP_START_TENTHS * plan.inner / 10;
    plan.lattice = plan.lattice < 1 ? 1 : plan.lattice;
    return plan;
}

/* Lays the arrays out at `base`, or only counts their bytes when that is null. Every count is at
   most a few times 65537, so nothing can overflow. */
static size_t terrimpi_simp_layout(terrimpi_simplifier *s, const terrimpi_simp_plan *plan,
                                   void *base)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    size_t vertices = plan->lattice + plan->border, samples = (size_t)plan->cols * plan->rows;
    size_t triangles = 2 * plan->lattice + plan->border, spare = TERRIMPI_SIMP_MAX_DEGREE;
    size_t edges = 3 * plan->lattice + 2 * plan->border;
    s->sums = (terrimpi_simp_moments *)terrimpi_take(&b, edges, sizeof *s->sums);
    s->spare = (terrimpi_simp_moments *)terrimpi_take(&b, spare * spare, sizeof *s->spare);
    s->row_sums = (terrimpi_simp_row_prefix *)terrimpi_take(&b, samples, sizeof *s->row_sums);
    s->x = (int32_t *)terrimpi_take(&b, vertices, sizeof *s->x);
    s->z = (int32_t *)terrimpi_take(&b, vertices, sizeof *s->z);
    s->height = (float *)terrimpi_take(&b, vertices, sizeof *s->height);
    s->out_edge = (int32_t *)terrimpi_take(&b, vertices, sizeof *s->out_edge);
    s->cost = (float *)terrimpi_take(&b, vertices, sizeof *s->cost);
    s->target = (int32_t *)terrimpi_take(&b, vertices, sizeof *s->target);
    s->stale = (uint8_t *)terrimpi_take(&b, vertices, sizeof *s->stale);
    s->origin = (int32_t *)terrimpi_take(&b, 4 * triangles, sizeof *s->origin);
    s->twin = (int32_t *)terrimpi_take(&b, 4 * triangles, sizeof *s->twin);
    s->edge = (int32_t *)terrimpi_take(&b, 4 * triangles, sizeof *s->edge);
    s->square = (float *)terrimpi_take(&b, triangles, sizeof *s->square);
    return b.bytes;
}

static int terrimpi_simp_all_finite(const float *values, uint32_t count)
{
    while (count > 0 && terrimpi_finite(values[count - 1]))
        count--;
    return count == 0;
}

static int terrimpi_simp_tile_size_ok(uint32_t cols, uint32_t rows)
{
    return terrimpi_within_u32(cols, 2, TERRIMP_MAX_TILE_DIM) &&
           terrimpi_within_u32(rows, 2, TERRIMP_MAX_TILE_DIM);
}

TERRIMP_API size_t terrimp_simplify_scratch_bytes(uint32_t cols, uint32_t rows,
                                                  uint32_t triangle_budget)
{
    terrimpi_simplifier s;
    terrimpi_simp_plan plan;
    if (!terrimpi_simp_tile_size_ok(cols, rows) || triangle_budget == 1 ||
        triangle_budget > TERRIMP_MAX_TRIANGLES)
        return 0;
    plan = terrimpi_simp_make_plan(cols, rows, triangle_budget, 4);
    plan.border = plan.budget + 2; /* whatever border comes, the arrays are large enough */
    return terrimpi_simp_layout(&s, &plan, NULL);
}

TERRIMP_API terrimp_result terrimp_mesh_capacity(uint32_t triangle_budget,
                                                 uint32_t *vertex_capacity,
                                                 uint32_t *index_capacity)
{
    uint32_t budget = triangle_budget ? triangle_budget : TERRIMP_TRIANGLE_BUDGET;
    TERRIMPI_REFUSE(!vertex_capacity || !index_capacity, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(budget < 2 || budget > TERRIMP_MAX_TRIANGLES, TERRIMP_E_RANGE);
    /* budget + 2 vertices when all of them are on the border, and each skirt as many again */
    *vertex_capacity = 3 * (budget + 2);
    *index_capacity = 3 * budget + 2 * 6 * (budget + 2);
    return TERRIMP_OK;
}

/* Checks one border polyline: from sample 0 to the last one, rising, finite. */
static terrimp_result terrimpi_simp_check_border(const terrimp_border *border, uint32_t samples)
{
    uint32_t i;
    TERRIMPI_REFUSE(!border->points, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(border->point_count < 2 || border->point_count > samples ||
                    border->points[0].at != 0 ||
                    border->points[border->point_count - 1].at != samples - 1, TERRIMP_E_RANGE);
    for (i = 0; i < border->point_count; i++) {
        TERRIMPI_REFUSE(!terrimpi_finite(border->points[i].height), TERRIMP_E_NOT_FINITE);
        TERRIMPI_REFUSE(i > 0 && border->points[i].at <= border->points[i - 1].at, TERRIMP_E_RANGE);
    }
    return TERRIMP_OK;
}

static terrimp_result terrimpi_simp_check_desc(const terrimp_simplify_desc *desc)
{
    const terrimp_border *b = desc->borders;
    uint32_t i;
    TERRIMPI_REFUSE(!desc->heights, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_simp_tile_size_ok(desc->cols, desc->rows) ||
                    desc->triangle_budget == 1 ||
                    desc->triangle_budget > TERRIMP_MAX_TRIANGLES, TERRIMP_E_RANGE);
    for (i = 0; i < TERRIMP_SIDE_COUNT; i++)
        TERRIMPI_TRY(terrimpi_simp_check_border(
            b + i, terrimpi_along_x((int)i) ? desc->cols : desc->rows));
    for (i = 0; i < 4u; i++) { /* the two borders that meet in each corner */
        uint32_t x_end = i & 1u, z_end = i >> 1;
        const terrimp_border *p = b + (z_end ? TERRIMP_SIDE_Z1 : TERRIMP_SIDE_Z0);
        const terrimp_border *q = b + (x_end ? TERRIMP_SIDE_X1 : TERRIMP_SIDE_X0);
        if (p->points[x_end ? p->point_count - 1 : 0].height !=
            q->points[z_end ? q->point_count - 1 : 0].height)
            return TERRIMP_E_RANGE;
    }
    return terrimpi_simp_all_finite(desc->heights, desc->cols * desc->rows) ? TERRIMP_OK
                                                                       : TERRIMP_E_NOT_FINITE;
}

/* Writes the inner vertices and the triangles; the border's vertices are in place. */
static void terrimpi_simp_emit(const terrimpi_simplifier *s, const float *exact_heights,
                               terrimp_mesh *mesh)
{
    int32_t v, e, vertices = s->border_count, indices = 0;
    for (v = 0; v < s->border_count; v++)
        s->target[v] = v;
    for (; v < s->vertex_count; v++)
        if (s->out_edge[v] >= 0) {
            terrimp_mesh_vertex *out = mesh->vertices + vertices;
            out->x = (uint16_t)s->x[v];
            out->z = (uint16_t)s->z[v];
            out->height = exact_heights ? exact_heights[s->z[v] * s->cols + s->x[v]]
                                        : s->middle + s->unit * s->height[v];
            s->target[v] = vertices++;
        }
    for (e = 0; e < s->half_edge_end; e++)
        if ((e & 3) != 3 && s->origin[e] >= 0)
            mesh->indices[indices++] = (uint16_t)s->target[s->origin[e]];
    mesh->border_vertex_count = (uint32_t)s->border_count;
    mesh->vertex_count = mesh->surface_vertex_count = (uint32_t)vertices;
    mesh->index_count = mesh->surface_index_count = (uint32_t)indices;
}

/* Makes the mesh between its borders: collapses, then flips and moves. On a squeezed tile a
   collapse can be barred on every side: then the start mesh is made anew, so coarse that it
   needs none. */
static void terrimpi_simp_reduce(terrimpi_simplifier *s, const terrimp_simplify_desc *desc,
                                 const terrimpi_simp_plan *plan, terrimp_mesh_vertex *loop)
{
    int32_t budget = (int32_t)plan->budget;
    terrimpi_simp_fit_all(s);
    terrimpi_simp_seek_extremes(s);
    terrimpi_simp_collapse_to(s, budget);
    if (s->triangle_count > budget) {
        terrimpi_simp_start(s, desc, (int32_t)plan->inner, loop);
        terrimpi_simp_fit_all(s);
    }
    terrimpi_simp_polish(s);
}

/* terrimp_simplify, of a tile whose last column and row may be squeezed. */
static terrimp_result terrimpi_simp_run(const terrimp_simplify_desc *desc,
                                        const terrimpi_simp_last_spacing *squeeze, void *scratch,
                                        size_t scratch_bytes, terrimp_mesh *mesh)
{
    terrimpi_simplifier s;
    terrimpi_simp_plan plan;
    uint32_t budget, border = 0;
    int whole, i;
    TERRIMPI_REFUSE(!desc || !scratch || !mesh, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_simp_check_desc(desc));
    budget = desc->triangle_budget ? desc->triangle_budget : TERRIMP_TRIANGLE_BUDGET;
    for (i = 0; i < TERRIMP_SIDE_COUNT; i++)
        border += desc->borders[i].point_count - 1;
    TERRIMPI_REFUSE(border > budget + 2, TERRIMP_E_RANGE);
    plan = terrimpi_simp_make_plan(desc->cols, desc->rows, budget, border);
    TERRIMPI_REFUSE(!mesh->vertices || !mesh->indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(mesh->vertex_capacity < border + plan.inner ||
                    mesh->index_capacity < 3 * (border - 2 + 2 * plan.inner), TERRIMP_E_CAPACITY);
    TERRIMPI_REFUSE(scratch_bytes < terrimp_simplify_scratch_bytes(desc->cols, desc->rows, budget),
                    TERRIMP_E_MEMORY);
    TERRIMPI_REFUSE((uintptr_t)scratch % sizeof(int64_t) != 0, TERRIMP_E_ALIGN);
    terrimpi_simp_layout(&s, &plan, scratch);
    s.cols = (int32_t)desc->cols;
    s.rows = (int32_t)desc->rows;
    s.squeeze = squeeze;
    terrimpi_simp_read_samples(&s, desc->heights);
    whole = terrimpi_simp_start(&s, desc, (int32_t)plan.lattice, mesh->vertices) &&
            s.triangle_count <= (int32_t)budget;
    if (!whole)
        terrimpi_simp_reduce(&s, desc, &plan, mesh->vertices);
    terrimpi_simp_emit(&s, whole ? desc->heights : 0, mesh);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_simplify(const terrimp_simplify_desc *desc, void *scratch,
                                            size_t scratch_bytes, terrimp_mesh *mesh)
{
    return terrimpi_simp_run(desc, NULL, scratch, scratch_bytes, mesh);
}

/* --- skirts (Hess 4.2) --- */

static terrimp_result terrimpi_raise_check_surface(const terrimp_mesh *mesh)
{
    TERRIMPI_REFUSE(!mesh || !mesh->vertices || !mesh->indices, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(mesh->border_vertex_count < 4 || mesh->surface_index_count < 6 ||
                    mesh->surface_vertex_count < mesh->border_vertex_count ||
                    mesh->vertex_count < mesh->surface_vertex_count ||
                    mesh->index_count < mesh->surface_index_count ||
                    mesh->vertex_capacity < mesh->vertex_count ||
                    mesh->index_capacity < mesh->index_count, TERRIMP_E_STATE);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_mesh_add_skirt(terrimp_mesh *mesh, int upper, float height)
{
    uint32_t i, n;
    TERRIMPI_TRY(terrimpi_raise_check_surface(mesh));
    n = mesh->border_vertex_count;
    TERRIMPI_REFUSE(mesh->vertex_capacity - mesh->vertex_count < n ||
                    mesh->index_capacity - mesh->index_count < 6 * n, TERRIMP_E_CAPACITY);
    TERRIMPI_REFUSE(!terrimpi_finite(height), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(upper && height < 0.0f, TERRIMP_E_RANGE);
    for (i = 0; i < n; i++) {
        terrimp_mesh_vertex *rim = mesh->vertices + mesh->vertex_count + i;
        *rim = mesh->vertices[i];
        rim->height = upper ? rim->height + height : terrimpi_min(rim->height, height);
    }
    terrimpi_terrain_write_wall(mesh->indices + mesh->index_count, n, mesh->vertex_count, upper);
    mesh->vertex_count += n;
    mesh->index_count += 6 * n;
    return TERRIMP_OK;
}

/* --- standing proud (Hess 6.1) --- */

/* Free vertices rise by at most 1 / this of a sample's shortfall: else one sample beside a corner
   would throw the vertex at the other end up. Over 65 x 65 samples of the Pyrenees 0.25
   leaves 0.46 % of all samples standing out, 0.5 leaves 1.2 %, 1 leaves 2.8 %, with a mean largest
   error of 10.3, 7.2 and 5.5 % of the terrain's range; pictures in flight are best at 0.5. */
#define TERRIMPI_RAISE_LEAST_HOLD 0.5f

/* Passes of lowering. Each takes away about a third of what is too high. 12 passes would make the
   error of meshes 0.6 % less in rms and the same in the largest, and no picture better by more than
   0.05 dB, for a fifth of the time of building. */
#define TERRIMPI_RAISE_LOWER_PASSES 4

/* Raise of a sample's free vertices, of weight `hold` together, that lifts the surface by `rest`,
   what is left of the sample's first shortfall. */
static float terrimpi_raise_wanted(float rest, float shortfall, float hold)
{
    if (!(rest > 0.0f) || !(hold > 0.0f))
        return 0.0f;
    return terrimpi_min(rest / hold, terrimpi_max(shortfall, rest) / TERRIMPI_RAISE_LEAST_HOLD);
}

/* A vertex of weight w in a sample rises by what that wants. */
static void terrimpi_raise_up(float w, float wanted, float *change)
{
    if (w > 1e-6f)
        *change = terrimpi_max(*change, wanted);
}

/* A vertex of weight w in a sample, one of n round it, may lose its share of the surface's height
   over the sample. That this is no less than it may lose by others, a product mostly tells without
   a division. */
static void terrimpi_raise_down(float w, float n, float over, float *change)
{
    if (w > 1e-6f && over < *change * (n * w) * 1.00001f)
        *change = terrimpi_min(*change, over / (n * w));
}

/* What a mesh misses, and that mesh. */
typedef struct terrimpi_raise {
    const float *miss; /* [rows][cols] how far the samples are above the mesh */
    uint32_t cols, rows;
    const terrimp_mesh *mesh;
} terrimpi_raise;

static float terrimpi_raise_is_free(const terrimpi_raise *r, const terrimp_mesh_vertex *v)
{
    int corner = (v->x == 0 || v->x == r->cols - 1) && (v->z == 0 || v->z == r->rows - 1);
    return corner ? 0.0f : 1.0f;
}

/* Goes once over the samples of a border between vertices a and b, which are in rising order
   whichever way the loop runs: both neighbours compute the same bits. */
static void terrimpi_raise_segment(const terrimpi_raise *r, uint32_t a, uint32_t b,
                                   const float *raise, float *change, int lowering)
{
    const terrimp_mesh_vertex *p = r->mesh->vertices + a, *q = r->mesh->vertices + b;
    uint32_t stride = p->z == q->z ? 1 : r->cols;
    const float *miss = r->miss + p->z * r->cols + p->x;
    int32_t k, count = p->z == q->z ? q->x - p->x : q->z - p->z;
    float free_a = terrimpi_raise_is_free(r, p), free_b = terrimpi_raise_is_free(r, q);
    for (k = 0; k <= count; k++, miss += stride) {
        float w = (float)k / (float)count, over, wanted;
        over = (1.0f - w) * raise[a] + w * raise[b] - *miss;
        wanted = terrimpi_raise_wanted(-over, *miss, (1.0f - w) * free_a + w * free_b);
        if (lowering) {
            over = terrimpi_max(0.0f, over);
            terrimpi_raise_down(1.0f - w, 2.0f, over, change + a);
            terrimpi_raise_down(w, 2.0f, over, change + b);
        } else {
            terrimpi_raise_up(1.0f - w, wanted, change + a);
            terrimpi_raise_up(w, wanted, change + b);
        }
    }
}

/* What each pass begins with, and what it does to a vertex: the first one raises, others lower, by
   no more than the vertex is raised. */
static float terrimpi_raise_begin(int pass, float raise) { return pass ? raise : 0.0f; }

static float terrimpi_raise_end(int pass, float raise, float change)
{
    return pass ? raise - change : change;
}

/* Raises the loop's vertices, border by border, but for the corners. */
static void terrimpi_raise_loop(const terrimpi_raise *r, float *raise, float *change)
{
    const terrimp_mesh_vertex *v = r->mesh->vertices;
    uint32_t n = r->mesh->border_vertex_count, first = 0, last, i;
    int side, pass;
    for (side = 0; side < 4; side++, first = last) {
        int along_x = side & 1, backwards = side >= 2;
        for (last = first + 1; last < n && (along_x ? v[last].z == v[first].z
                                                    : v[last].x == v[first].x); last++) {
        }
        if (side < 3)
            last--; /* the loop's end closes the last side itself */
        for (pass = 0; pass <= TERRIMPI_RAISE_LOWER_PASSES; pass++) {
            for (i = first; i <= last; i++)
                change[i % n] = terrimpi_raise_begin(pass, raise[i % n]);
            for (i = first; i < last; i++)
                terrimpi_raise_segment(r, backwards ? (i + 1) % n : i, backwards ? i : (i + 1) % n,
                                       raise, change, pass > 0);
            for (i = first + 1; i < last; i++)
                raise[i] = terrimpi_raise_end(pass, raise[i], change[i]);
        }
    }
}

/* The slopes of the plane through three vertices, of heights h. */
static void terrimpi_raise_plane(const terrimp_mesh_vertex v[3], float h0, float h1, float h2,
                                 float *gx, float *gz)
{
    int32_t bx = v[1].x - v[0].x, bz = v[1].z - v[0].z;
    int32_t cx = v[2].x - v[0].x, cz = v[2].z - v[0].z;
    float inverse = 1.0f / (float)(bz * cx - bx * cz), hb = h1 - h0, hc = h2 - h0;
    *gx = ((float)bz * hc - (float)cz * hb) * inverse;
    *gz = ((float)cx * hb - (float)bx * hc) * inverse;
}

/* Goes once over the samples of a triangle. */
static void terrimpi_raise_triangle(const terrimpi_raise *r, const uint16_t *t, const float *raise,
                                    float *change, int lowering)
{
    terrimp_mesh_vertex v[3];
    terrimpi_simp_span span;
    float slope_x[3], slope_z[3], gx, gz, to[3], h[3];
    float limit; /* how far above a sample the surface is when that changes nothing; no weight is
                    above 1 */
    int32_t x, z, k;
    for (k = 0; k < 3; k++) {
        to[k] = change[t[k]];
        v[k] = r->mesh->vertices[t[k]];
        h[k] = raise[t[k]];
    }
    for (k = 0; k < 3; k++) /* of the weights */
        terrimpi_raise_plane(v, (float)(k == 0), (float)(k == 1), (float)(k == 2), &slope_x[k],
                             &slope_z[k]);
    terrimpi_simp_find_span(v, &span);
    terrimpi_raise_plane(v, h[0], h[1], h[2], &gx, &gz);
    limit = lowering ? 3.001f * terrimpi_largest(to) : 0.0f;
    for (z = span.low; z < span.high; z++) {
        const float *row = r->miss + z * (int32_t)r->cols;
        float dx = (float)(span.left[z] - v[0].x), dz = (float)(z - v[0].z), rise = dz * gz;
        for (x = span.left[z]; x < span.right[z]; x++, dx += 1.0f) {
            float miss = row[x], over = h[0] + dx * gx + rise - miss, w[3], hold = 0.0f, wanted;
            if (over >= limit)
                continue;
            w[0] = 1.0f + dx * slope_x[0] + dz * slope_z[0];
            w[1] = dx * slope_x[1] + dz * slope_z[1];
            w[2] = dx * slope_x[2] + dz * slope_z[2];
            if (lowering) {
                over = terrimpi_max(over, 0.0f);
                terrimpi_raise_down(w[0], 3.0f, over, &to[0]);
                terrimpi_raise_down(w[1], 3.0f, over, &to[1]);
                terrimpi_raise_down(w[2], 3.0f, over, &to[2]);
                limit = 3.001f * terrimpi_largest(to);
                continue;
            }
            for (k = 0; k < 3; k++)
                hold += t[k] >= r->mesh->border_vertex_count ? w[k] : 0.0f;
            wanted = terrimpi_raise_wanted(-over, miss, hold);
            for (k = 0; k < 3; k++)
                terrimpi_raise_up(w[k], wanted, &to[k]);
        }
    }
    for (k = 0; k < 3; k++)
        change[t[k]] = to[k];
}

/* Finds by how much to raise each vertex so that no sample is above the mesh but for rounding,
   except beside vertices that may not be raised: a sample whose weight hangs by more than half on
   corners (on a border) or on border vertices (inside) may stay above. Corners stay where they are,
   since four tiles share them; border vertices follow from the samples of their border alone, so
   that neighbours still meet. Starts from every vertex raised by the largest shortfall round it and
   lowers them together as far as the samples let it.

   raise   [2 * surface_vertex_count] out: in its first half the raises */
static void terrimpi_raise_find(const terrimpi_raise *r, float *raise)
{
    const terrimp_mesh *mesh = r->mesh;
    uint32_t n = mesh->surface_vertex_count, i;
    float *change = raise + n;
    int pass;
    for (i = 0; i < n; i++)
        raise[i] = 0.0f;
    terrimpi_raise_loop(r, raise, change);
    for (pass = 0; pass <= TERRIMPI_RAISE_LOWER_PASSES; pass++) {
        for (i = 0; i < n; i++) /* the border stays */
            change[i] = i < mesh->border_vertex_count ? 0.0f : terrimpi_raise_begin(pass, raise[i]);
        for (i = 0; i < mesh->surface_index_count; i += 3)
            terrimpi_raise_triangle(r, mesh->indices + i, raise, change, pass > 0);
        for (i = mesh->border_vertex_count; i < n; i++)
            raise[i] = terrimpi_raise_end(pass, raise[i], change[i]);
    }
}

/* ==== Builder ============================================================ >>impl-builder */
/* Based on: Hess 2010, sections 3.1, 4.2 and 6.5; de Boer 2000, section 2.3. */

/* ---- voids ----

   Level 1 halves the field, and so on until a level is one cell. A cell is known when a cell below
   it is, and is then the mean of those; so the last is known. Downwards again, unknown cells start
   from the level above and are relaxed towards the mean of their four neighbours. The full
   resolution needs no copy in float: its sweeps follow each other down the field, one row apart, in
   a ring of a few rows. All steps take means, so nothing leaves the range of the valid samples. */

enum {
    TERRIMPI_FILL_SWEEPS = 6,     /* at full resolution; each coarser level takes twice as many */
    TERRIMPI_FILL_MAX_SWEEPS = 64,
    TERRIMPI_FILL_RING = TERRIMPI_FILL_SWEEPS + 2,
    TERRIMPI_FILL_LEVELS = 18     /* 65537 samples halve 17 times to one */
};

typedef struct terrimpi_fill_level {
    float *value;   /* [depth][width] */
    uint8_t *known; /* [depth][width] */
    uint32_t width, depth;
} terrimpi_fill_level;

/* Level 0 is the ring, whose depth counts the rows of the field all the same. */
typedef struct terrimpi_fill {
    terrimpi_fill_level level[TERRIMPI_FILL_LEVELS];
    uint32_t level_count;
    float low, high; /* raw range of the valid samples */
} terrimpi_fill;

/* Lays the levels out behind each other: first all values, then, in the same order, all known
   flags. Returns the bytes; 0 if they overflow. */
static size_t terrimpi_fill_layout(uint32_t width, uint32_t depth, void *scratch,
                                   terrimpi_fill *fill)
{
    size_t first[TERRIMPI_FILL_LEVELS], cells = 0;
    uint32_t count = 0, rows = TERRIMPI_FILL_RING, w = width, d = depth, i;
    int ok = 1;
    for (;;) {
        first[count] = cells;
        cells = terrimpi_add(cells, terrimpi_mul(w, rows, &ok), &ok);
        fill->level[count].width = w;
        fill->level[count].depth = d;
        ++count;
        if (w == 1u && d == 1u)
            break;
        w = (w + 1u) / 2u;
        d = (d + 1u) / 2u;
        rows = d;
    }
    fill->level_count = count;
    for (i = 0; i < count && scratch != NULL; ++i) {
        fill->level[i].value = (float *)scratch + first[i];
        fill->level[i].known = (uint8_t *)((float *)scratch + cells) + first[i];
    }
    cells = terrimpi_mul(cells, sizeof(float) + 1u, &ok);
    return ok ? cells : 0;
}

TERRIMP_API size_t terrimp_heightfield_fill_voids_scratch_bytes(uint32_t width, uint32_t depth)
{
    terrimpi_fill fill;
    return terrimpi_field_size_ok(width, depth) ? terrimpi_fill_layout(width, depth, NULL, &fill) :
        0;
}

/* Brings row z of the field into the ring and marks its voids. */
static void terrimpi_fill_load(const terrimp_heightfield *field, const terrimpi_fill *fill,
                               uint32_t z)
{
    size_t first = (size_t)(z % TERRIMPI_FILL_RING) * field->width;
    float *value = fill->level[0].value + first;
    uint8_t *known = fill->level[0].known + first;
    uint32_t x;
    terrimpi_field_read_row(field, 0, z, field->width, 1, 0.0f, 1.0f, value);
    for (x = 0; x < field->width; ++x)
        known[x] = (uint8_t)(value[x] != field->no_data && value[x] == value[x]);
}

/* The rows of a level above and below row z; at the edges of the field the row itself. */
static size_t terrimpi_fill_row(const terrimpi_fill *fill, uint32_t level, uint32_t z)
{
    uint32_t depth = fill->level[level].depth;
    z = z < depth ? z : depth - 1u;
    return (size_t)(level == 0 ? z % TERRIMPI_FILL_RING : z) * fill->level[level].width;
}

/* Row z of a level becomes the mean of what is known in the 2 x 2 cells below each of its cells. An
   odd last row or column is taken twice, which leaves the mean alone. */
static void terrimpi_fill_pull(const terrimpi_fill *fill, uint32_t level, uint32_t z)
{
    static const float share[5] = {0.0f, 4.0f, 2.0f, 4.0f / 3.0f, 1.0f};
    const terrimpi_fill_level *up = &fill->level[level], *from = &fill->level[level - 1u];
    size_t row0 = terrimpi_fill_row(fill, level - 1u, 2u * z);
    size_t row1 = terrimpi_fill_row(fill, level - 1u, 2u * z + 1u);
    float *value = up->value + (size_t)z * up->width;
    uint8_t *known = up->known + (size_t)z * up->width;
    uint32_t x, k;
    for (x = 0; x < up->width; ++x) {
        size_t x0 = 2u * x, x1 = x0 + 1u < from->width ? x0 + 1u : x0, cell[4];
        float sum = 0.0f;
        uint32_t count = 0;
        cell[0] = row0 + x0;
        cell[1] = row0 + x1;
        cell[2] = row1 + x0;
        cell[3] = row1 + x1;
        for (k = 0; k < 4; ++k)
            if (from->known[cell[k]]) {
                sum += 0.25f * from->value[cell[k]]; /* the quarter first: no overflow */
                ++count;
            }
        value[x] = sum * share[count];
        known[x] = (uint8_t)(count != 0);
    }
}

/* The unknown cells of row z start between the four nearest cells of the level above. */
static void terrimpi_fill_push(const terrimpi_fill *fill, uint32_t level, uint32_t z)
{
    const terrimpi_fill_level *to = &fill->level[level], *up = &fill->level[level + 1u];
    size_t row = terrimpi_fill_row(fill, level, z);
    uint32_t side = (z & 1u) ? z / 2u + 1u : z / 2u - (z > 0);
    const float *own = up->value + terrimpi_fill_row(fill, level + 1u, z / 2u);
    const float *other = up->value + terrimpi_fill_row(fill, level + 1u, side);
    uint32_t x;
    for (x = 0; x < to->width; ++x) {
        uint32_t a = x / 2u, b = (x & 1u) ? (a + 1u < up->width ? a + 1u : a) : a - (a > 0);
        if (!to->known[row + x])
            to->value[row + x] = 0.75f * (0.75f * own[a] + 0.25f * own[b]) +
                                 0.25f * (0.75f * other[a] + 0.25f * other[b]);
    }
}

/* One relaxation of row z: each unknown cell becomes the mean of its neighbours. Those in the row
   count as they were before (Jacobi), which treats left and right alike and lets the processor work
   on many cells at once. Outside of the field a neighbour is the cell itself: nothing flows over
   the edge. */
static void terrimpi_fill_relax(const terrimpi_fill *fill, uint32_t level, uint32_t z)
{
    const terrimpi_fill_level *on = &fill->level[level];
    size_t first = terrimpi_fill_row(fill, level, z);
    const float *above = on->value + terrimpi_fill_row(fill, level, z - (z > 0));
    const float *below = on->value + terrimpi_fill_row(fill, level, z + 1u);
    const uint8_t *known = on->known + first;
    float *row = on->value + first, left, own;
    uint32_t x = 0, last = on->width - 1u;
    while (x <= last) {
        const void *next = memchr(known + x, 0, last - x + 1u);
        if (next == NULL)
            return;
        x = (uint32_t)((const uint8_t *)next - known);
        left = row[x - (x > 0)];
        for (; x <= last && !known[x]; ++x) {
            own = row[x];
            row[x] = (0.25f * left + 0.25f * row[x + (x < last)]) +
                     (0.25f * above[x] + 0.25f * below[x]);
            left = own;
        }
    }
}

static void terrimpi_fill_coarse(const terrimpi_fill *fill)
{
    uint32_t level, z, sweep, sweeps;
    for (level = 2; level < fill->level_count; ++level)
        for (z = 0; z < fill->level[level].depth; ++z)
            terrimpi_fill_pull(fill, level, z);
    for (level = fill->level_count - 1u; level-- > 1u;) {
        sweeps = level < 4u ? (uint32_t)TERRIMPI_FILL_SWEEPS << level
                            : (uint32_t)TERRIMPI_FILL_MAX_SWEEPS;
        for (z = 0; z < fill->level[level].depth; ++z)
            terrimpi_fill_push(fill, level, z);
        /* Down and up by turns, so that neither end of the field is preferred. */
        for (sweep = 0; sweep < sweeps; ++sweep)
            for (z = 0; z < fill->level[level].depth; ++z)
                terrimpi_fill_relax(fill, level,
                                    (sweep & 1u) ? fill->level[level].depth - 1u - z : z);
    }
}

/* A filled value must not be the no-data value by chance. It lies between low and high then, and
   neither of them is the no-data value: there is room. */
static float terrimpi_fill_not_void(const terrimp_heightfield *field, const terrimpi_fill *fill,
                                    float value)
{
    float moved;
    if (value != field->no_data)
        return value;
    if (field->format != TERRIMP_FORMAT_F32)
        return value + 1.0f;
    moved = value + (fill->high - value) * (1.0f / 1048576.0f);
    return moved != value ? moved : fill->high;
}

/* Writes the filled samples of row z from the ring to the field. */
static void terrimpi_fill_store(const terrimp_heightfield *field, const terrimpi_fill *fill,
                                char *samples, uint32_t z)
{
    size_t first = terrimpi_fill_row(fill, 0, z);
    const float *value = fill->level[0].value + first;
    const uint8_t *known = fill->level[0].known + first;
    void *row = samples + (size_t)z * field->row_bytes;
    uint32_t x;
    for (x = 0; x < field->width; ++x) {
        float v;
        if (known[x])
            continue;
        v = terrimpi_clamp(value[x], fill->low, fill->high);
        if (field->format != TERRIMP_FORMAT_F32)
            v = (float)((int32_t)(v + 32768.5f) - 32768); /* to nearest, below zero too */
        v = terrimpi_fill_not_void(field, fill, v);
        switch (field->format) {
        case TERRIMP_FORMAT_U8: ((uint8_t *)row)[x] = (uint8_t)v; break;
        case TERRIMP_FORMAT_U16: ((uint16_t *)row)[x] = (uint16_t)v; break;
        case TERRIMP_FORMAT_S16: ((int16_t *)row)[x] = (int16_t)v; break;
        default: ((float *)row)[x] = v; break;
        }
    }
}

/* Full resolution: at step r row r enters the ring, sweep s relaxes row r - s, and the row that has
   had all sweeps leaves. Each sweep finds the row above done and the row below one sweep behind. */
static void terrimpi_fill_fine(const terrimp_heightfield *field, const terrimpi_fill *fill,
                               char *samples)
{
    uint32_t r, s;
    for (r = 0; r < field->depth + TERRIMPI_FILL_SWEEPS; ++r) {
        if (r < field->depth) {
            terrimpi_fill_load(field, fill, r);
            terrimpi_fill_push(fill, 0, r);
        }
        for (s = 1; s <= TERRIMPI_FILL_SWEEPS; ++s)
            if (r >= s && r - s < field->depth)
                terrimpi_fill_relax(fill, 0, r - s);
        if (r >= TERRIMPI_FILL_SWEEPS)
            terrimpi_fill_store(field, fill, samples, r - TERRIMPI_FILL_SWEEPS);
    }
}

/* Reads the field into level 1. */
static void terrimpi_fill_read(const terrimp_heightfield *field, const terrimpi_fill *fill)
{
    uint32_t z;
    for (z = 0; z < field->depth; ++z) {
        terrimpi_fill_load(field, fill, z);
        if ((z & 1u) || z == field->depth - 1u)
            terrimpi_fill_pull(fill, 1, z / 2u);
    }
}

TERRIMP_API terrimp_result terrimp_heightfield_fill_voids(const terrimp_heightfield *field,
                                                          void *samples, void *scratch,
                                                          size_t scratch_bytes,
                                                          size_t *filled_count)
{
    terrimp_heightfield f;
    terrimpi_fill fill;
    terrimpi_field_scan scan;
    size_t needed;
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_REFUSE(samples == NULL || scratch == NULL, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(samples != f.samples, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE((uintptr_t)scratch % sizeof(float) != 0, TERRIMP_E_ALIGN);
    needed = terrimpi_fill_layout(f.width, f.depth, scratch, &fill);
    TERRIMPI_REFUSE(needed == 0, TERRIMP_E_OVERFLOW);
    TERRIMPI_REFUSE(scratch_bytes < needed, TERRIMP_E_MEMORY);

    scan.skip_voids = 1;
    TERRIMPI_TRY(terrimpi_field_scan_tile(&f, 0, 0, f.width, f.depth, 1, &scan));
    TERRIMPI_REFUSE(scan.low > scan.high, TERRIMP_E_VOID);
    fill.low = scan.low;
    fill.high = scan.high;
    if (scan.voids > 0) {
        terrimpi_fill_read(&f, &fill);
        terrimpi_fill_coarse(&fill);
        terrimpi_fill_fine(&f, &fill, (char *)samples);
    }
    if (filled_count != NULL)
        *filled_count = scan.voids;
    return TERRIMP_OK;
}

/* ---- heights and errors of the ground ---- */

/* What the samples of a node are found to miss. */
typedef struct terrimpi_build_residual {
    float most, squares;
    float count;
    float low, high; /* of the samples beyond borders */
} terrimpi_build_residual;

/* Notes how far `count` samples are from a straight line. */
static void terrimpi_build_residual_run(const float *height, uint32_t count, float start,
                                        float slope, terrimpi_build_residual *misses)
{
    float most = misses->most, squares = 0.0f;
    uint32_t k;
    for (k = 0; k < count; k++) {
        float miss = height[k] - (start + slope * (float)k);
        squares += miss * miss;
        miss = miss < 0.0f ? -miss : miss;
        most = miss > most ? miss : most;
    }
    misses->most = most;
    misses->squares += squares;
}

/* Compares one row of samples, `down` of `deep` rows below the lattice row `upper`, with the
   triangles between that and the row `lower`. */
static void terrimpi_build_residual_row(const float *upper, const float *lower, const float *row,
                                        uint32_t span, uint32_t step, uint32_t down, uint32_t deep,
                                        terrimpi_build_residual *misses)
{
    float v = (float)down / (float)deep;
    uint32_t at, i = 0;
    for (at = 0; at < span; at += step, i++) {
        float a = upper[i], b = upper[i + 1u], c = lower[i], d = lower[i + 1u];
        uint32_t wide = terrimpi_min_u32(step, span - at);
        uint32_t left = down * wide / deep + 1u; /* samples up to the diagonal */
        float one = 1.0f / (float)wide, u = (float)left * one;
        left = terrimpi_min_u32(left, wide);
        terrimpi_build_residual_run(row + at, left, a + v * (c - a), (d - c) * one, misses);
        terrimpi_build_residual_run(row + at + left, wide - left, a + v * (d - b) + u * (b - a),
                                    (b - a) * one, misses);
    }
    terrimpi_build_residual_run(row + span, 1, upper[i] + v * (lower[i] - upper[i]), 0.0f, misses);
    misses->count += (float)span + 1.0f;
}

/* Compares all samples of a node with its triangles in pattern 0. */
static void terrimpi_build_residual_inner(const terrimp_quadtree *t, terrimp_node p,
                                          float *scratch, terrimpi_build_residual *misses)
{
    uint32_t quads = t->chunk_quads, j, z;
    uint32_t x0 = terrimpi_tree_col(t, p.level, p.x * quads);
    uint32_t span = terrimpi_tree_col(t, p.level, (p.x + 1u) * quads) - x0;
    float *upper = scratch, *lower = upper + quads + 1u, *row = lower + quads + 1u;
    for (j = p.z * quads; j < (p.z + 1u) * quads; j++) {
        uint32_t z0 = terrimpi_tree_row(t, p.level, j), z1 = terrimpi_tree_row(t, p.level, j + 1u);
        if (z1 == z0)
            break;
        terrimpi_field_tile(&t->field, x0, z0, quads + 1u, 1, 1u << p.level, upper);
        terrimpi_field_tile(&t->field, x0, z1, quads + 1u, 1, 1u << p.level, lower);
        for (z = z0; z <= z1; z++) { /* lattice rows twice: which weighs next to nothing in rms */
            terrimpi_field_tile(&t->field, x0, z, span + 1u, 1, 1, row);
            terrimpi_build_residual_row(upper, lower, row, span, 1u << p.level, z - z0, z1 - z0,
                                        misses);
        }
    }
}

static float terrimpi_build_sample(const terrimp_quadtree *t, const int64_t at[2])
{
    return terrimpi_field_sample(&t->field, (uint32_t)at[0], (uint32_t)at[1]);
}

/* Compares the samples in a triangle of three samples, counter-clockwise, with it. */
static void terrimpi_build_residual_triangle(const terrimp_quadtree *t, const int64_t a[2],
                                             const int64_t b[2], const int64_t c[2],
                                             terrimpi_build_residual *misses)
{
    int64_t all = terrimpi_twice_area(a, b, c), low[2], high[2], at[2];
    float height = terrimpi_build_sample(t, a);
    float to_b = terrimpi_build_sample(t, b) - height, to_c = terrimpi_build_sample(t, c) - height;
    int k;
    if (all <= 0)
        return;
    for (k = 0; k < 2; k++) {
        low[k] = a[k] < b[k] ? a[k] : b[k];
        high[k] = a[k] > b[k] ? a[k] : b[k];
        low[k] = low[k] < c[k] ? low[k] : c[k];
        high[k] = high[k] > c[k] ? high[k] : c[k];
    }
    for (at[1] = low[1]; at[1] <= high[1]; at[1]++)
        for (at[0] = low[0]; at[0] <= high[0]; at[0]++) {
            int64_t by_b = terrimpi_twice_area(c, a, at), by_c = terrimpi_twice_area(a, b, at);
            float sample, miss;
            if (by_b < 0 || by_c < 0 || by_b + by_c > all)
                continue;
            sample = terrimpi_build_sample(t, at);
            miss = sample - height;
            miss -= (to_b * (float)by_b + to_c * (float)by_c) / (float)all;
            misses->most = terrimpi_max(misses->most, terrimpi_abs(miss));
            misses->low = terrimpi_min(misses->low, sample);
            misses->high = terrimpi_max(misses->high, sample);
        }
}

/* Compares with what a finer neighbour beyond a side draws up to it: two of its quads for each of
   the node's, in the pattern in which that side is coarse. */
static void terrimpi_build_residual_border(const terrimp_quadtree *t, terrimp_node p, int side,
                                           terrimpi_build_residual *misses)
{
    uint32_t quads = t->chunk_quads, along, k, c;
    int along_x = terrimpi_along_x(side), last = side & 1;
    terrimpi_mip_writer block; /* 2 x 2 quads of the neighbour */
    block.quads = 2;
    block.pattern = 1u << (side ^ 1);
    for (along = 0; along < 2u * quads; along++) {
        uint32_t across = last ? 0u : 1u, first[2];
        int64_t at[4][2];
        first[!along_x] = along & ~1u;
        first[along_x] = last ? 2u * quads : (uint32_t)-2;
        for (c = 0; c < 4u; c++) { /* counter-clockwise */
            uint32_t i = (along_x ? along & 1u : across) + (c >> 1);
            uint32_t j = (along_x ? across : along & 1u) + ((c + 1u) >> 1 & 1u);
            k = terrimpi_mip_index(&block, i, j);
            at[c][0] = terrimpi_tree_col(t, p.level - 1u, 2u * p.x * quads + first[0] + k % 3u);
            at[c][1] = terrimpi_tree_row(t, p.level - 1u, 2u * p.z * quads + first[1] + k / 3u);
        }
        terrimpi_build_residual_triangle(t, at[0], at[2], at[3], misses);
        terrimpi_build_residual_triangle(t, at[0], at[1], at[2], misses);
    }
}

static terrimp_result terrimpi_build_ground_leaf(const terrimp_quadtree *t, terrimp_node p)
{
    terrimp_geomip_node *node = &t->nodes[p.number];
    uint32_t quads = t->chunk_quads;
    terrimp_rect samples = terrimpi_rect(p.x * quads, p.z * quads, quads + 1u, quads + 1u);
    TERRIMPI_TRY(terrimpi_field_range(&t->field, samples, 0, &node->low, &node->high));
    node->error = node->rms = 0.0f;
    return TERRIMP_OK;
}

/* Finds heights, error and rms of one node, from samples alone. */
static terrimp_result terrimpi_build_ground(const terrimp_quadtree *tree, uint32_t node,
                                            float *scratch)
{
    terrimp_node p = terrimpi_tree_node(tree, node), beyond;
    terrimpi_build_residual misses;
    int side;
    if (p.level == 0)
        return terrimpi_build_ground_leaf(tree, p);
    memset(&misses, 0, sizeof misses);
    terrimpi_build_residual_inner(tree, p, scratch, &misses);
    misses.low = misses.high = terrimpi_field_sample(
        &tree->field, terrimpi_tree_col(tree, p.level, p.x * tree->chunk_quads),
        terrimpi_tree_row(tree, p.level, p.z * tree->chunk_quads));
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
        if (terrimpi_tree_beyond(tree, &p, side, &beyond))
            terrimpi_build_residual_border(tree, p, side, &misses);
    tree->nodes[node].low = misses.low;
    tree->nodes[node].high = misses.high;
    tree->nodes[node].error = misses.most;
    tree->nodes[node].rms = TERRIMP_SQRTF(misses.squares / misses.count);
    return TERRIMP_OK;
}

/* Notes that a node holds what another one holds. */
static void terrimpi_build_hold_ground(terrimp_geomip_node *node, const terrimp_geomip_node *held)
{
    node->low = terrimpi_min(node->low, held->low);
    node->high = terrimpi_max(node->high, held->high);
    node->error = terrimpi_max(node->error, held->error);
}

TERRIMP_API terrimp_result terrimp_geomip_build(const terrimp_quadtree *tree, float *scratch)
{
    uint32_t i;
    TERRIMPI_REFUSE(!tree || !scratch || !tree->nodes, TERRIMP_E_NULL);
    for (i = 0; i < tree->node_count; i++)
        TERRIMPI_TRY(terrimpi_build_ground(tree, i, scratch));
    for (i = 0; i + 1u < tree->node_count; i++)
        terrimpi_build_hold_ground(&tree->nodes[terrimpi_tree_parent_number(tree, i)],
                                   &tree->nodes[i]);
    return TERRIMP_OK;
}

/* ---- the survey of a mesh by all samples of its node ---- */

/* An edge of a triangle as the rows of samples meet it: in row z, of low <= z < high, it stands at
   column x + (z - low) * slope and height h + (z - low) * rise. */
typedef struct terrimpi_build_edge {
    uint32_t low, high;
    float x, slope, h, rise;
} terrimpi_build_edge;

/* A triangle: the sides that have it on their right, and those that have it on their left. */
typedef struct terrimpi_build_triangle {
    uint32_t low, high, left_count, right_count;
    terrimpi_build_edge left[2], right[2];
} terrimpi_build_triangle;

/* Scratch of one node. */
typedef struct terrimpi_build {
    float *tile;            /* [side][side] what the simplifier sees; then what it missed */
    float *row;             /* samples of one row or column of the node; scratch of its errors */
    float *tops;            /* of a border: see terrimpi_build_ground_tops */
    float *work;            /* [2][vertex] of the raising */
    terrimp_mesh_vertex *vertices;
    uint16_t *indices;
    terrimpi_build_triangle *facets; /* [triangle] */
    uint32_t vertex_capacity, index_capacity;
    uint32_t border_points; /* inner ones that a border keeps */
    void *rest;
    size_t rest_bytes;
} terrimpi_build;

/* Lays it out for a tile, of a node that has up to `longest` samples along a side. */
static size_t terrimpi_build_layout_tile(uint32_t cols, uint32_t rows, size_t longest,
                                         uint32_t budget, void *base, terrimpi_build *build)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    size_t vertices;
    terrimp_mesh_capacity(budget, &build->vertex_capacity, &build->index_capacity);
    build->border_points = terrimpi_terrain_border_points(budget);
    build->rest_bytes = terrimp_simplify_scratch_bytes(cols, rows, budget);
    vertices = build->vertex_capacity;
    build->tile = (float *)terrimpi_take(&b, (size_t)cols * rows, sizeof *build->tile);
    build->row = (float *)terrimpi_take(&b, longest, sizeof *build->row);
    build->tops = (float *)terrimpi_take(&b, longest, sizeof *build->tops);
    build->work = (float *)terrimpi_take(&b, 2u * vertices, sizeof *build->work);
    build->vertices =
        (terrimp_mesh_vertex *)terrimpi_take(&b, vertices, sizeof *build->vertices);
    build->indices =
        (uint16_t *)terrimpi_take(&b, build->index_capacity, sizeof *build->indices);
    build->facets =
        (terrimpi_build_triangle *)terrimpi_take(&b, budget, sizeof *build->facets);
    build->rest = terrimpi_take(&b, build->rest_bytes, 1);
    return b.ok && build->rest_bytes ? b.bytes : 0;
}

static size_t terrimpi_build_layout(const terrimp_terrain_desc *desc, void *base,
                                    terrimpi_build *build)
{
    uint32_t side = desc->chunk_quads + 1u;
    size_t longest = terrimpi_max_u32(desc->field.width, desc->field.depth) + 2u * side;
    return terrimpi_build_layout_tile(side, side, longest, desc->triangle_budget, base, build);
}

/* Whether a block of scratch will do for a terrain. */
static terrimp_result terrimpi_build_check(const terrimp_terrain *t, const void *scratch,
                                           size_t bytes)
{
    terrimpi_build build;
    return terrimpi_check_block(scratch, bytes, terrimpi_build_layout(&t->desc, NULL, &build));
}

/* Adds the side from p to q of a triangle whose corners run counter-clockwise seen from above. */
static void terrimpi_build_add_edge(const terrimpi_terrain_tile *p, const terrimp_mesh_vertex *from,
                                    const terrimp_mesh_vertex *to, terrimpi_build_triangle *facet)
{
    const terrimp_mesh_vertex *a = from->z < to->z ? from : to, *b = a == from ? to : from;
    terrimpi_build_edge *side;
    float x, inverse;
    if (a->z == b->z)
        return;
    side = a == from ? &facet->left[facet->left_count++] : &facet->right[facet->right_count++];
    side->low = terrimpi_lattice(a->z, p->level, p->span_z);
    side->high = terrimpi_lattice(b->z, p->level, p->span_z);
    side->x = (float)terrimpi_lattice(a->x, p->level, p->span_x);
    x = (float)terrimpi_lattice(b->x, p->level, p->span_x);
    inverse = 1.0f / (float)(side->high - side->low);
    side->slope = (x - side->x) * inverse;
    side->h = a->height;
    side->rise = (b->height - a->height) * inverse;
    facet->low = terrimpi_min_u32(facet->low, side->low);
    facet->high = terrimpi_max_u32(facet->high, side->high);
}

/* Describes the triangles of a surface. */
static void terrimpi_build_setup_triangles(const terrimpi_terrain_tile *p, const terrimp_mesh *mesh,
                                           terrimpi_build_triangle *facets)
{
    uint32_t i, k;
    for (i = 0; i < mesh->surface_index_count; i += 3u, facets++) {
        const uint16_t *corner = mesh->indices + i;
        memset(facets, 0, sizeof *facets);
        facets->low = 0xffffffffu;
        for (k = 0; k < 3u; k++)
            terrimpi_build_add_edge(p, mesh->vertices + corner[k],
                                    mesh->vertices + corner[k == 2u ? 0 : k + 1u], facets);
    }
}

/* Where the row meets the one of two sides that crosses it; returns that side. */
static const terrimpi_build_edge *terrimpi_build_cross_row(const terrimpi_build_edge *sides,
                                                           uint32_t count, uint32_t z,
                                                           float *x, float *h)
{
    const terrimpi_build_edge *side = count > 1u && z - sides[1].low < sides[1].high - sides[1].low
                                    ? sides + 1
                                    : sides;
    float down = (float)(z - side->low);
    *x = terrimpi_max(side->x + down * side->slope, 0.0f);
    *h = side->h + down * side->rise;
    return side;
}

/* Takes the surface away from samples that lie on a straight line of it: from column `first` to the
   one before `end`, when it has height h at column x. */
static void terrimpi_build_subtract(float *row, uint32_t first, uint32_t end, float x, float h,
                                    float slope)
{
    float start = h + ((float)first - x) * slope;
    uint32_t i, count = end > first ? end - first : 0;
    for (i = 0; i < count; i++)
        row[first + i] -= start + (float)i * slope;
}

/* A segment of the loop, in rising order, and the samples of the border that it begins and ends
   at. */
typedef struct terrimpi_build_segment {
    uint32_t a, b, from, to;
} terrimpi_build_segment;

/* The segment from vertex i of the loop to the next; returns 0 when it is not on that side. */
static int terrimpi_build_segment_of(const terrimpi_terrain_tile *p, const terrimp_mesh *mesh,
                                     int side, uint32_t i, terrimpi_build_segment *s)
{
    const terrimp_mesh_vertex *v = mesh->vertices;
    int along_x = terrimpi_along_x(side), last = side & 1; /* Z1, X1 */
    uint32_t span = along_x ? p->span_x : p->span_z;
    uint32_t at = !last ? 0u : along_x ? p->rows - 1u : p->cols - 1u;
    uint32_t next = (i + 1u) % mesh->border_vertex_count, from, to;
    if ((along_x ? v[i].z : v[i].x) != at || (along_x ? v[next].z : v[next].x) != at)
        return 0;
    from = along_x ? v[i].x : v[i].z;
    to = along_x ? v[next].x : v[next].z;
    s->a = from < to ? i : next; /* the loop runs the other way on the far two sides */
    s->b = from < to ? next : i;
    s->from = terrimpi_lattice(terrimpi_min_u32(from, to), p->level, span);
    s->to = terrimpi_lattice(terrimpi_max_u32(from, to), p->level, span);
    return 1;
}

/* Takes the surface away from the samples of one border, whose line the loop has. */
static void terrimpi_build_subtract_border(const terrimpi_terrain_tile *p, const terrimp_mesh *mesh,
                                           int side, float *line)
{
    uint32_t i, span = terrimpi_along_x(side) ? p->span_x : p->span_z;
    terrimpi_build_segment s;
    for (i = 0; i < mesh->border_vertex_count; i++) {
        const terrimp_mesh_vertex *v = mesh->vertices;
        if (terrimpi_build_segment_of(p, mesh, side, i, &s))
            terrimpi_build_subtract(line, s.from, s.to + (s.to == span), (float)s.from,
                                    v[s.a].height,
                                    (v[s.b].height - v[s.a].height) / (float)(s.to - s.from));
    }
}

/* Reads row z of a node and takes the surface away: what is left is how far each sample is above
   it. Triangles share the columns at which a row crosses their sides, so every sample counts for
   exactly one of them. */
static void terrimpi_build_residual_of_row(const terrimp_heightfield *field,
                                           const terrimpi_terrain_tile *p,
                                           const terrimp_mesh *mesh, const terrimpi_build *build,
                                           uint32_t z)
{
    const terrimpi_build_triangle *facet = build->facets, *end = facet + mesh->surface_index_count /
        3u;
    float *row = build->row, last = (float)p->span_x;
    terrimpi_field_tile(field, p->x, p->z + z, p->span_x + 1u, 1, 1, row);
    if (z == p->span_z) {
        terrimpi_build_subtract_border(p, mesh, TERRIMP_SIDE_Z1, row);
        return;
    }
    for (; facet < end; facet++) {
        const terrimpi_build_edge *right;
        float x0, x1, h0, h1;
        uint32_t first, limit;
        if (z < facet->low || z >= facet->high)
            continue;
        terrimpi_build_cross_row(facet->left, facet->left_count, z, &x0, &h0);
        right = terrimpi_build_cross_row(facet->right, facet->right_count, z, &x1, &h1);
        first = terrimpi_ceil_u32(terrimpi_min(x0, last));
        limit = terrimpi_ceil_u32(terrimpi_min(x1, last));
        if (x1 > x0)
            terrimpi_build_subtract(row, first, limit, x0, h0, (h1 - h0) / (x1 - x0));
        if (x1 >= last && right->slope == 0.0f) /* this side is the last column */
            row[p->span_x] -= h1;
    }
}

/* ---- one mesh ---- */

/* The samples that column or row k inside a tile stands for, first and end: of those inside the
   node, the ones that are closer to it than to another. */
static void terrimpi_build_window(uint32_t k, uint32_t level, uint32_t count, uint32_t span,
                                  uint32_t *first, uint32_t *end)
{
    uint32_t half = (1u << level) / 2u;
    *first = k == 1u ? 1u : (k << level) - half;
    *end = k + 2u == count ? span : ((k + 1u) << level) - half;
}

/* The mean of the samples round place k of a line, half a step to either side. */
static float terrimpi_build_line_mean(const float *line, uint32_t k, uint32_t level, uint32_t span)
{
    uint32_t half = (1u << level) / 2u, i, first = (k << level) - half;
    uint32_t end = terrimpi_min_u32((k << level) + half + 1u, span);
    float sum = 0.0f;
    for (i = first; i < end; i++)
        sum += line[i];
    return sum / (float)(end - first);
}

/* Reads one of a node's borders, along +x or +z; returns how many quads it spans. */
static uint32_t terrimpi_build_read_border(const terrimp_heightfield *field,
                                           const terrimpi_terrain_tile *p, int side, float *line)
{
    int along_x = terrimpi_along_x(side);
    uint32_t x = side == TERRIMP_SIDE_X1 ? p->x + p->span_x : p->x;
    uint32_t z = side == TERRIMP_SIDE_Z1 ? p->z + p->span_z : p->z;
    uint32_t span = along_x ? p->span_x : p->span_z;
    terrimpi_field_tile(field, x, z, along_x ? span + 1u : 1u,
                        along_x ? 1u : span + 1u, 1, line);
    return span;
}

/* Where a border stands in a tile: its first place, and the way to the next; returns the places. */
static uint32_t terrimpi_build_tile_border(const terrimpi_terrain_tile *p, int side,
                                           uint32_t *first, uint32_t *step)
{
    *first = side == TERRIMP_SIDE_Z1   ? (p->rows - 1u) * p->cols
             : side == TERRIMP_SIDE_X1 ? p->cols - 1u
                                         : 0u;
    *step = terrimpi_along_x(side) ? 1u : p->cols;
    return terrimpi_along_x(side) ? p->cols : p->rows;
}

/* Fills the tile that the simplifier works on: at level 0 the samples, above that the mean of those
   round each place (single samples give 1 to 7 % more error). Borders are made of their own samples
   alone, and corners are samples, so that the nodes that share them agree. */
static void terrimpi_build_tile(const terrimp_heightfield *field, const terrimpi_terrain_tile *p,
                                const terrimpi_build *build)
{
    uint32_t i, k, z, half = (1u << p->level) / 2u, first, step;
    int side;
    for (k = 1; k + 1u < p->rows; k++) {
        float *out = build->tile + k * p->cols;
        uint32_t from = (k << p->level) - half;
        uint32_t to = terrimpi_min_u32((k << p->level) + half + 1u, p->span_z);
        for (i = 0; i < p->cols; i++)
            out[i] = 0.0f;
        for (z = from; z < to; z++) {
            terrimpi_field_tile(field, p->x, p->z + z, p->span_x, 1, 1, build->row);
            for (i = 1; i + 1u < p->cols; i++)
                out[i] += terrimpi_build_line_mean(build->row, i, p->level, p->span_x);
        }
        for (i = 0; i < p->cols; i++)
            out[i] /= (float)(to - from);
    }
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        uint32_t span = terrimpi_build_read_border(field, p, side, build->row);
        uint32_t count = terrimpi_build_tile_border(p, side, &first, &step);
        for (k = 0; k < count; k++)
            build->tile[first + k * step] =
                k == 0 || k + 1u == count ? build->row[terrimpi_lattice(k, p->level, span)]
                                          : terrimpi_build_line_mean(build->row, k, p->level, span);
    }
}

#define TERRIMPI_BUILD_POINTS 52u /* of a border of the largest budget */

/* Simplifies the tile between its four borders, of as many points as the budget asks for. */
static terrimp_result terrimpi_build_simplify(const terrimpi_terrain_tile *p, uint32_t budget,
                                              const terrimpi_build *build, terrimp_mesh *mesh)
{
    terrimp_border_point points[TERRIMP_SIDE_COUNT][TERRIMPI_BUILD_POINTS];
    float line[TERRIMP_MAX_TILE_DIM];
    terrimp_simplify_desc desc;
    terrimpi_simp_last_spacing squeeze;
    int side;
    squeeze.step = 1 << (p->level + p->coarse);
    squeeze.last_x = (int32_t)((p->span_x << p->coarse) - p->cut_x);
    squeeze.last_z = (int32_t)((p->span_z << p->coarse) - p->cut_z);
    desc.heights = build->tile;
    desc.cols = p->cols;
    desc.rows = p->rows;
    desc.triangle_budget = budget;
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        uint32_t first, step, k, count = terrimpi_build_tile_border(p, side, &first, &step);
        for (k = 0; k < count; k++)
            line[k] = build->tile[first + k * step];
        TERRIMPI_TRY(terrimp_border_simplify(line, count, build->border_points, points[side],
                                             TERRIMPI_BUILD_POINTS,
                                             &desc.borders[side].point_count));
        desc.borders[side].points = points[side];
    }
    return terrimpi_simp_run(&desc,
                             ((squeeze.last_x | squeeze.last_z) % squeeze.step) ? &squeeze : NULL,
                             build->rest, build->rest_bytes, mesh);
}

/* Finds what a mesh misses along a border: for each place of the tile there the largest height of
   a sample round it over the polyline. From the border's own samples alone. */
static void terrimpi_build_border_shortfall(const terrimp_heightfield *field,
                                            const terrimpi_terrain_tile *p, int side,
                                            const terrimp_mesh *mesh, const terrimpi_build *build)
{
    uint32_t span = terrimpi_build_read_border(field, p, side, build->row), first, step, i, k;
    uint32_t count = terrimpi_build_tile_border(p, side, &first, &step);
    terrimpi_build_subtract_border(p, mesh, side, build->row);
    build->tile[first] = build->tile[first + (count - 1u) * step] = 0.0f;
    for (k = 1; k + 1u < count; k++) {
        uint32_t from, end;
        float most;
        terrimpi_build_window(k, p->level, count, span, &from, &end);
        most = build->row[from];
        for (i = from + 1u; i < end; i++)
            most = terrimpi_max(most, build->row[i]);
        build->tile[first + k * step] = most;
    }
}

/* Fills the tile with what the mesh misses: for each place the largest height of a sample round it
   over the surface. */
static void terrimpi_build_shortfall(const terrimp_heightfield *field,
                                     const terrimpi_terrain_tile *p, const terrimp_mesh *mesh,
                                     const terrimpi_build *build)
{
    uint32_t i, k, x, z;
    int side;
    terrimpi_build_setup_triangles(p, mesh, build->facets);
    for (k = 1; k + 1u < p->rows; k++) {
        float *out = build->tile + k * p->cols;
        uint32_t from, to;
        terrimpi_build_window(k, p->level, p->rows, p->span_z, &from, &to);
        for (z = from; z < to; z++) {
            terrimpi_build_residual_of_row(field, p, mesh, build, z);
            for (i = 1; i + 1u < p->cols; i++) {
                uint32_t first, end;
                float most;
                terrimpi_build_window(i, p->level, p->cols, p->span_x, &first, &end);
                most = z == from ? build->row[first] : terrimpi_max(out[i], build->row[first]);
                for (x = first + 1u; x < end; x++)
                    most = terrimpi_max(most, build->row[x]);
                out[i] = most;
            }
        }
    }
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
        terrimpi_build_border_shortfall(field, p, side, mesh, build);
}

/* Raises the mesh so that it stands proud of all samples. A raise is a piecewise linear function
   over the same triangles, so it is found from what is missed: there the places of the tile stand
   for all samples round them, however steep the terrain is. To do so twice halves the samples that
   still stand out, from 0.3 to 0.15 %, and makes the error larger by a tenth to a fifth: not worth
   it. */
static void terrimpi_build_raise(const terrimp_heightfield *field, const terrimpi_terrain_tile *p,
                                 float proud, terrimp_mesh *mesh, const terrimpi_build *build)
{
    terrimpi_raise raise;
    uint32_t i;
    terrimpi_build_shortfall(field, p, mesh, build);
    raise.miss = build->tile;
    raise.cols = p->cols;
    raise.rows = p->rows;
    raise.mesh = mesh;
    terrimpi_raise_find(&raise, build->work);
    for (i = 0; i < mesh->surface_vertex_count; i++)
        mesh->vertices[i].height += proud * build->work[i];
}

/* The highest that ground can be drawn at each sample of a border: of levels up to one the lines
   between every 2^level-th sample. */
static void terrimpi_build_ground_tops(const terrimpi_build *build, uint32_t span,
                                       uint32_t top_level)
{
    const float *line = build->row;
    uint32_t level, from, to, k;
    memcpy(build->tops, line, (span + 1u) * sizeof *line);
    for (level = 1; level <= top_level; level++)
        for (from = 0; from < span; from = to) {
            float slope;
            to = terrimpi_min_u32(from + (1u << level), span);
            slope = (line[to] - line[from]) / (float)(to - from);
            for (k = from + 1u; k < to; k++)
                build->tops[k] = terrimpi_max(build->tops[k],
                                              line[from] + slope * (float)(k - from));
        }
}

/* Lifts the border until it is a little over all ground beside it: the corners, which are samples,
   and lines of coarser ground over valleys would stand out, and ground that is level with a
   border has other vertices there, so that a pixel may show the sky. What is missing at a place
   of a segment is asked of its closer end, at most twice as much, which stays within the range
   of stored heights; a raised vertex may have left that. So a ray that comes in over a mesh's
   border comes in over all ground behind it, and what other meshes have over that is closed by
   their skirts, which reach below the samples (see terrimpi_mesh_skirt_foot): there is no gap to
   see the sky through. Ground beside a mesh that is coarser by more than it is lifted for could
   leave one, of less than its tolerance; to lift borders over all of it would double the errors
   of meshes where ridges are steep. Neighbours of a level still share what lies between the
   corners. */
static void terrimpi_build_lift_border(const terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                       terrimp_mesh *mesh, const terrimpi_build *build)
{
    float *lift = build->work, over = terrimpi_mesh_under(t, p->level);
    uint32_t i, k;
    int side;
    terrimpi_build_segment s;
    for (i = 0; i < mesh->border_vertex_count; i++) {
        float *height = &mesh->vertices[i].height;
        *height = terrimpi_min(*height,
                               terrimpi_terrain_border_height(t, TERRIMPI_MESH_BORDER_STEPS));
        lift[i] = 0.0f;
    }
    for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++) {
        uint32_t span = terrimpi_build_read_border(&t->desc.field, p, side, build->row);
        terrimpi_build_ground_tops(build, span,
                                   p->level + terrimpi_mesh_lift(t->desc.chunk_quads));
        terrimpi_build_subtract_border(p, mesh, side, build->tops);
        for (i = 0; i < mesh->border_vertex_count; i++) {
            if (!terrimpi_build_segment_of(p, mesh, side, i, &s))
                continue;
            for (k = s.from; k <= s.to; k++) {
                float w = (float)(k - s.from) / (float)(s.to - s.from);
                float *to = lift + (w > 0.5f ? s.b : s.a);
                *to = terrimpi_max(*to, (build->tops[k] + over) / terrimpi_max(w, 1.0f - w));
            }
        }
    }
    for (i = 0; i < mesh->border_vertex_count; i++)
        mesh->vertices[i].height += lift[i];
}

/* The steps above `low` that a height is stored as: rounded up when meshes stand proud. */
static uint32_t terrimpi_build_height_steps(float height, float low, float step, uint32_t most,
                                            int up)
{
    float steps = height - low;
    uint32_t whole;
    if (!(steps > 0.0f) || !(step > 0.0f))
        return 0;
    steps /= step;
    if (!(steps < (float)most))
        return most;
    whole = (uint32_t)(up ? steps : steps + 0.5f);
    return whole + (uint32_t)(up && low + step * (float)whole < height && whole < most);
}

/* Settles what the heights of a node's inner vertices count from, in which steps: the exponent of
   the least power of two with which they reach to the highest. */
static uint32_t terrimpi_build_inner_range(const terrimp_terrain *t, const terrimp_mesh *mesh,
                                           float *base)
{
    float most = terrimpi_terrain_border_height(t, TERRIMPI_MESH_BORDER_STEPS), low = most, step;
    float high = t->range_low;
    uint32_t i;
    for (i = mesh->border_vertex_count; i < mesh->surface_vertex_count; i++) {
        mesh->vertices[i].height = terrimpi_clamp(mesh->vertices[i].height, t->range_low, most);
        low = terrimpi_min(low, mesh->vertices[i].height);
        high = terrimpi_max(high, mesh->vertices[i].height);
    }
    *base = low;
    step = terrimpi_max(0.0f, high - low) / (float)TERRIMPI_MESH_INNER_STEPS;
    return (terrimpi_float_bits(step) + 0x7fffffu) >> 23;
}

/* A vertex of a surface as it is stored. */
static uint32_t terrimpi_build_store_point(const terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                           const terrimpi_mesh *mesh, const terrimp_mesh_vertex *v,
                                           int inner)
{
    int up = t->desc.proud > 0.0f, side;
    if (inner)
        return v->x | (uint32_t)v->z << 8 |
               terrimpi_build_height_steps(v->height, mesh->base, terrimpi_mesh_step(mesh),
                                           TERRIMPI_MESH_INNER_STEPS, up) << 16;
    side = v->x == 0               ? TERRIMP_SIDE_X0
           : v->z == 0             ? TERRIMP_SIDE_Z0
           : v->x == p->cols - 1u  ? TERRIMP_SIDE_X1
                                   : TERRIMP_SIDE_Z1;
    return (terrimpi_along_x(side) ? v->x : v->z) | (uint32_t)side << 8 |
           terrimpi_build_height_steps(v->height, t->range_low, t->range_step,
                                       TERRIMPI_MESH_BORDER_STEPS, up)
               << 10;
}

/* Stores a surface, and leaves in it the heights that have been stored. */
static void terrimpi_build_store_surface(terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                         uint32_t node, const terrimp_mesh *mesh)
{
    terrimpi_mesh *out = &t->meshes[node];
    uint32_t *points = t->points + (size_t)node * t->vertex_limit;
    uint32_t *corners = t->corners + (size_t)node * (t->index_limit / 4u), i;
    TERRIMP_ASSERT(mesh->surface_vertex_count <= t->vertex_limit);
    TERRIMP_ASSERT(mesh->border_vertex_count <= t->border_limit);
    memset(points, 0, t->vertex_limit * sizeof *points);
    memset(corners, 0, t->index_limit);
    out->counts = terrimpi_build_inner_range(t, mesh, &out->base) << 24 |
                  mesh->surface_vertex_count << 16 | mesh->border_vertex_count << 9 |
                  mesh->surface_index_count / 3u;
    for (i = 0; i < mesh->surface_vertex_count; i++) {
        terrimp_mesh_vertex *v = &mesh->vertices[i];
        points[i] = terrimpi_build_store_point(t, p, out, v, i >= mesh->border_vertex_count);
        v->height = terrimpi_mesh_point(t, p, node, i).height;
        out->low = i == 0 ? v->height : terrimpi_min(out->low, v->height);
        out->high = i == 0 ? v->height : terrimpi_max(out->high, v->height);
    }
    for (i = 0; i < mesh->surface_index_count; i++)
        corners[i / 4u] |= (uint32_t)mesh->indices[i] << i % 4u * 8u;
}

/* Differences of samples to the surface. */
typedef struct terrimpi_build_error {
    float above, below, squares;
} terrimpi_build_error;

static void terrimpi_build_add_error(terrimpi_build_error *error, float difference)
{
    error->above = terrimpi_max(error->above, difference);
    error->below = terrimpi_max(error->below, -difference);
    error->squares += difference * difference;
}

/* Measures a mesh against every sample of its node. */
static void terrimpi_build_measure_node(const terrimp_heightfield *field,
                                        const terrimpi_terrain_tile *p, const terrimp_mesh *mesh,
                                        const terrimpi_build *build, terrimpi_build_error *error,
                                        float *rms)
{
    uint32_t x, z;
    float squares = 0.0f;
    error->above = error->below = 0.0f;
    terrimpi_build_setup_triangles(p, mesh, build->facets);
    for (z = 0; z <= p->span_z; z++) {
        terrimpi_build_residual_of_row(field, p, mesh, build, z);
        error->squares = 0.0f; /* summed by row, as small sums round less */
        for (x = 0; x <= p->span_x; x++)
            terrimpi_build_add_error(error, build->row[x]);
        squares += error->squares;
    }
    *rms = TERRIMP_SQRTF(squares / ((float)(p->span_x + 1u) * (float)(p->span_z + 1u)));
}

static terrimp_result terrimpi_build_mesh(terrimp_terrain *t, uint32_t node,
                                          const terrimpi_build *build)
{
    terrimpi_terrain_tile p = terrimpi_terrain_tile_of(t, node);
    terrimp_mesh mesh;
    terrimpi_build_error error;
    float rms;
    terrimpi_build_tile(&t->desc.field, &p, build);
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = build->vertices;
    mesh.indices = build->indices;
    mesh.vertex_capacity = build->vertex_capacity;
    mesh.index_capacity = build->index_capacity;
    TERRIMPI_TRY(terrimpi_build_simplify(&p, t->desc.triangle_budget, build, &mesh));
    if (t->desc.proud > 0.0f) {
        terrimpi_build_raise(&t->desc.field, &p, t->desc.proud, &mesh, build);
        terrimpi_build_lift_border(t, &p, &mesh, build);
    }
    terrimpi_build_store_surface(t, &p, node, &mesh);
    terrimpi_build_measure_node(&t->desc.field, &p, &mesh, build, &error, &rms);
    if (!terrimpi_finite2(error.above, error.below)) {
        t->meshes[node].counts = 0;
        return TERRIMP_E_NOT_FINITE;
    }
    t->meshes[node].error = terrimpi_max(error.above, error.below);
    t->meshes[node].error_rms = rms;
    return TERRIMP_OK;
}

/* ---- a rectangle by one call ---- */

static size_t terrimpi_build_layout_rect(const terrimp_rect *samples, uint32_t budget, void *base,
                                         terrimpi_build *build)
{
    budget = budget ? budget : TERRIMP_TRIANGLE_BUDGET;
    if (!terrimpi_simp_tile_size_ok(samples->width, samples->height) ||
        !terrimpi_within_u32(budget, 6u, TERRIMP_MAX_TRIANGLES))
        return 0;
    return terrimpi_build_layout_tile(samples->width, samples->height, TERRIMP_MAX_TILE_DIM, budget,
                                      base, build);
}

TERRIMP_API size_t terrimp_simplify_field_scratch_bytes(uint32_t cols, uint32_t rows,
                                                        uint32_t triangle_budget)
{
    terrimp_rect samples = terrimpi_rect(0, 0, cols, rows);
    terrimpi_build build;
    return terrimpi_build_layout_rect(&samples, triangle_budget, NULL, &build);
}

/* Simplifies the tile to a budget and finds the largest error. */
static terrimp_result terrimpi_build_rect(const terrimp_heightfield *field,
                                          const terrimpi_terrain_tile *p, uint32_t budget,
                                          const terrimpi_build *build, terrimp_mesh *mesh,
                                          float *off)
{
    terrimpi_build_error error;
    float rms;
    TERRIMPI_TRY(terrimpi_build_simplify(p, budget, build, mesh));
    terrimpi_build_measure_node(field, p, mesh, build, &error, &rms);
    *off = terrimpi_max(error.above, error.below);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_simplify_field(const terrimp_heightfield *field,
                                                  const terrimp_rect *samples,
                                                  uint32_t triangle_budget, float max_error,
                                                  void *scratch, size_t bytes, terrimp_mesh *mesh,
                                                  float *error)
{
    terrimp_heightfield f;
    terrimpi_terrain_tile p;
    terrimpi_build build;
    uint32_t low, high = triangle_budget ? triangle_budget : TERRIMP_TRIANGLE_BUDGET, budget = high;
    float off;
    size_t needed;
    TERRIMPI_REFUSE(!field || !samples || !mesh, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite(max_error), TERRIMP_E_NOT_FINITE);
    needed = terrimpi_build_layout_rect(samples, high, scratch, &build);
    TERRIMPI_REFUSE(needed == 0 || max_error < 0.0f, TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(samples->x > field->width - samples->width || field->width < samples->width ||
                    samples->y > field->depth - samples->height ||
                    field->depth < samples->height, TERRIMP_E_RANGE);
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes, needed));
    TERRIMPI_TRY(terrimp_heightfield_resolve(field, &f));
    TERRIMPI_TRY(terrimp_heightfield_read(&f, samples->x, samples->y, samples->width,
                                          samples->height, 1, build.tile));
    memset(&p, 0, sizeof p);
    p.x = samples->x;
    p.z = samples->y;
    p.cols = samples->width;
    p.rows = samples->height;
    p.span_x = p.cols - 1u;
    p.span_z = p.rows - 1u;
    TERRIMPI_TRY(terrimpi_build_rect(&f, &p, high, &build, mesh, &off));
    low = terrimpi_max_u32(2u, mesh->border_vertex_count - 2u);
    while (max_error > 0.0f && off <= max_error && low < high) { /* high is enough; is this? */
        float less;
        budget = low + (high - low) / 2u;
        TERRIMPI_TRY(terrimpi_build_rect(&f, &p, budget, &build, mesh, &less));
        if (less <= max_error) {
            high = budget;
            off = less;
        } else {
            low = budget + 1u;
        }
    }
    if (budget != high)
        TERRIMPI_TRY(terrimpi_build_rect(&f, &p, high, &build, mesh, &off));
    if (error)
        *error = off;
    return TERRIMP_OK;
}

/* ---- all nodes ---- */

static uint32_t terrimpi_build_stale_words(const terrimp_terrain *t)
{
    return t->tree.node_count / 32u + 1u;
}

/* The one description of a terrain's block. */
static size_t terrimpi_build_layout_block(terrimp_terrain *t, unsigned char *base)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    size_t arrays = terrimpi_terrain_layout(t, NULL);
    terrimpi_take(&b, 1, sizeof *t);
    terrimpi_terrain_layout(t, (unsigned char *)terrimpi_take(&b, arrays, 1));
    t->stale = (uint32_t *)terrimpi_take(&b, terrimpi_build_stale_words(t), sizeof *t->stale);
    return b.ok && arrays ? b.bytes : 0;
}

TERRIMP_API size_t terrimp_terrain_bytes(const terrimp_terrain_desc *desc)
{
    terrimp_terrain t;
    memset(&t, 0, sizeof t); /* an analyser cannot know that resolve fills in the rest */
    return terrimp_terrain_desc_resolve(desc, &t.desc) == TERRIMP_OK
               ? terrimpi_build_layout_block(&t, NULL) : 0;
}

TERRIMP_API size_t terrimp_terrain_scratch_bytes(const terrimp_terrain_desc *desc)
{
    terrimp_terrain_desc d;
    terrimpi_build build;
    if (terrimp_terrain_desc_resolve(desc, &d) != TERRIMP_OK)
        return 0;
    return terrimpi_build_layout(&d, NULL, &build);
}

TERRIMP_API terrimp_result terrimp_terrain_init(const terrimp_terrain_desc *desc, void *memory,
                                                size_t bytes, terrimp_terrain **terrain)
{
    terrimp_terrain t;
    size_t needed;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    memset(&t, 0, sizeof t);
    TERRIMPI_TRY(terrimp_terrain_desc_resolve(desc, &t.desc));
    needed = terrimpi_build_layout_block(&t, NULL);
    TERRIMPI_REFUSE(needed == 0, TERRIMP_E_OVERFLOW);
    TERRIMPI_TRY(terrimpi_check_block(memory, bytes, needed));
    memset(memory, 0, needed);
    terrimpi_build_layout_block(&t, (unsigned char *)memory);
    *(terrimp_terrain *)memory = t;
    *terrain = (terrimp_terrain *)memory;
    return TERRIMP_OK;
}

#define TERRIMPI_BUILD_EDIT_STEP 128u /* above it a node's heights stand for those of a part */

/* The room that vertices get below and above the samples, as a part of their range: heights fitted
   to one side of a ridge swing over on the other. */
#define TERRIMPI_BUILD_OVERSHOOT 1.0f

TERRIMP_API terrimp_result terrimp_terrain_build_begin(terrimp_terrain *terrain)
{
    float low, high, room, step;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->meshes, TERRIMP_E_STATE);
    low = terrain->desc.height_low;
    high = terrain->desc.height_high;
    if (low == 0.0f && high == 0.0f) {
        const terrimp_heightfield *f = &terrain->desc.field;
        terrimp_rect all = terrimpi_rect(0, 0, f->width, f->depth);
        TERRIMPI_TRY(terrimpi_field_range(f, all, 0, &low, &high));
    }
    room = TERRIMPI_BUILD_OVERSHOOT * (high - low);
    step = (high - low + 2.0f * room) / (float)TERRIMPI_MESH_BORDER_STEPS;
    TERRIMPI_REFUSE(!terrimpi_terrain_range_fits(&terrain->desc.field, low - room, step),
                    TERRIMP_E_RANGE);
    terrain->sample_low = low;
    terrain->sample_high = high;
    terrain->range_low = low - room;
    terrain->range_step = step;
    terrain->begun = 1;
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_terrain_build_node(terrimp_terrain *terrain, uint32_t node,
                                                      void *scratch, size_t bytes)
{
    terrimpi_build build;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(node >= terrain->tree.node_count, TERRIMP_E_RANGE);
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes,
                                      terrimpi_build_layout(&terrain->desc, scratch, &build)));
    TERRIMPI_REFUSE(!terrain->begun, TERRIMP_E_STATE);
    TERRIMPI_TRY(terrimpi_build_ground(&terrain->tree, node, build.row));
    TERRIMPI_REFUSE(node < terrain->tree.level_first[1] &&
                    (terrain->tree.nodes[node].low < terrain->sample_low ||
                     terrain->tree.nodes[node].high > terrain->sample_high), TERRIMP_E_RANGE);
    return terrimpi_build_mesh(terrain, node, &build);
}

/* Notes that a node holds another one, or its own samples. */
static void terrimpi_build_hold(terrimpi_mesh *mesh, float low, float high)
{
    mesh->low = terrimpi_min(mesh->low, low);
    mesh->high = terrimpi_max(mesh->high, high);
}

/* Notes that a node and its coarse mesh hold what another one holds. */
static void terrimpi_build_hold_node(terrimp_terrain *t, uint32_t node, uint32_t held)
{
    terrimpi_build_hold_ground(&t->tree.nodes[node], &t->tree.nodes[held]);
    terrimpi_build_hold(&t->meshes[node], t->meshes[held].low, t->meshes[held].high);
}

TERRIMP_API terrimp_result terrimp_terrain_build_finish(terrimp_terrain *terrain)
{
    const terrimp_quadtree *tree;
    uint32_t node;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->meshes, TERRIMP_E_STATE);
    tree = &terrain->tree;
    for (node = 0; node < tree->node_count; node++)
        TERRIMPI_REFUSE(terrimpi_mesh_vertices(&terrain->meshes[node]) == 0, TERRIMP_E_STATE);
    terrain->mesh_triangle_count = 0;
    for (node = 0; node < tree->node_count; node++) {
        terrimpi_build_hold(&terrain->meshes[node], tree->nodes[node].low, tree->nodes[node].high);
        terrain->mesh_triangle_count += terrimpi_mesh_triangles(&terrain->meshes[node]);
        if (node + 1u < tree->node_count)
            terrimpi_build_hold_node(terrain, terrimpi_tree_parent_number(tree, node), node);
    }
    terrain->built = 1;
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_terrain_build(terrimp_terrain *terrain, void *scratch,
                                                 size_t bytes)
{
    uint32_t node;
    TERRIMPI_REFUSE(!terrain, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_build_check(terrain, scratch, bytes));
    TERRIMPI_TRY(terrimp_terrain_build_begin(terrain));
    for (node = 0; node < terrain->tree.node_count; node++)
        TERRIMPI_TRY(terrimp_terrain_build_node(terrain, node, scratch, bytes));
    return terrimp_terrain_build_finish(terrain);
}

/* ---- edits ---- */

/* Widens what is known of a node's ground for samples of a rectangle that have changed. A sample is
   as far from its triangle as heights within two of the level's steps differ, at most; it counts
   for the root mean square once, or twice on a row of vertices. */
static void terrimpi_build_edit_ground(terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                 uint32_t number, const terrimp_rect *rect, float low, float high)
{
    terrimp_geomip_node *n = &t->tree.nodes[number];
    uint32_t step = 1u << p->level, x = rect->x - terrimpi_min_u32(rect->x, 2u * step);
    uint32_t z = rect->y - terrimpi_min_u32(rect->y, 2u * step);
    float share, off;
    n->low = terrimpi_min(n->low, low);
    n->high = terrimpi_max(n->high, high);
    if (p->level == 0)
        return;
    off = n->high - n->low;
    if (step <= TERRIMPI_BUILD_EDIT_STEP &&
        terrimpi_field_range(&t->desc.field,
                             terrimpi_rect(x, z, rect->x - x + rect->width + 2u * step,
                                           rect->y - z + rect->height + 2u * step),
                             0, &low, &high) == TERRIMP_OK)
        off = terrimpi_min(off, high - low);
    share = 2.0f * (float)(rect->width + 2u * step) * (float)(rect->height + 2u * step) /
            ((float)(p->span_x + 1u) * (float)(p->span_z + 1u));
    n->rms = TERRIMP_SQRTF(n->rms * n->rms + terrimpi_min(share, 1.0f) * off * off);
    n->error = terrimpi_max(n->error, off);
}

/* The same for its coarse mesh, of which the triangles over the rectangle count. */
static void terrimpi_build_edit_mesh(terrimp_terrain *t, const terrimpi_terrain_tile *p,
                                     uint32_t number, const terrimp_rect *rect, float low,
                                     float high)
{
    terrimpi_mesh *mesh = &t->meshes[number];
    float least = TERRIMPI_FLOAT_MAX, most = -TERRIMPI_FLOAT_MAX, off, share;
    uint32_t i, k;
    for (i = 0; i < 3u * terrimpi_mesh_triangles(mesh); i += 3u) {
        uint32_t x0 = 0xffffffffu, z0 = x0, x1 = 0, z1 = 0;
        float heights[3];
        for (k = 0; k < 3u; k++) {
            uint32_t corner = terrimpi_mesh_corner(t, number, i + k);
            terrimpi_mesh_point_steps v = terrimpi_mesh_point(t, p, number, corner);
            uint32_t x = p->x + terrimpi_lattice(v.x, p->level, p->span_x);
            uint32_t z = p->z + terrimpi_lattice(v.z, p->level, p->span_z);
            x0 = terrimpi_min_u32(x0, x);
            z0 = terrimpi_min_u32(z0, z);
            x1 = terrimpi_max_u32(x1, x);
            z1 = terrimpi_max_u32(z1, z);
            heights[k] = v.height;
        }
        if (x1 < rect->x || x0 >= rect->x + rect->width || z1 < rect->y ||
            z0 >= rect->y + rect->height)
            continue;
        for (k = 0; k < 3u; k++) {
            least = terrimpi_min(least, heights[k]);
            most = terrimpi_max(most, heights[k]);
        }
    }
    if (least > most)
        return;
    off = terrimpi_max(high - least, most - low);
    share = (float)rect->width * (float)rect->height /
            ((float)(p->span_x + 1u) * (float)(p->span_z + 1u));
    mesh->error_rms = TERRIMP_SQRTF(mesh->error_rms * mesh->error_rms +
                                    terrimpi_min(share, 1.0f) * off * off);
    mesh->error = terrimpi_max(mesh->error, off);
}

TERRIMP_API terrimp_result terrimp_terrain_edit(terrimp_terrain *terrain,
                                                const terrimp_rect *samples)
{
    terrimp_rect rect;
    uint32_t level, x, z;
    float low, high;
    TERRIMPI_TRY(terrimpi_terrain_check_touched(terrain, samples));
    TERRIMPI_REFUSE(terrain->baked, TERRIMP_E_STATE);
    rect = *samples;
    rect.width = terrimpi_min_u32(rect.width, terrain->desc.field.width - rect.x);
    rect.height = terrimpi_min_u32(rect.height, terrain->desc.field.depth - rect.y);
    TERRIMPI_TRY(terrimpi_field_range(&terrain->desc.field, rect, 0, &low, &high));
    TERRIMPI_REFUSE(low < terrain->sample_low || high > terrain->sample_high, TERRIMP_E_RANGE);
    terrain->tree.edits++;
    for (level = 0; level < terrain->tree.level_count; level++) {
        terrimpi_terrain_touched in = terrimpi_terrain_touched_nodes(terrain, &rect, level, 0);
        for (z = in.z0; z <= in.z1; z++)
            for (x = in.x0; x <= in.x1; x++) {
                uint32_t node = terrimpi_tree_at(&terrain->tree, level, x, z).number;
                terrimpi_terrain_tile p = terrimpi_terrain_tile_of(terrain, node);
                terrimpi_build_edit_ground(terrain, &p, node, &rect, low, high);
                terrimpi_build_edit_mesh(terrain, &p, node, &rect, low, high);
                terrimpi_build_hold(&terrain->meshes[node], low, high);
                terrain->stale[node / 32u] |= 1u << node % 32u;
            }
    }
    return TERRIMP_OK;
}

/* Builds a node anew whose children are as they should be. Those above it are wide enough until it
   is their turn. */
static terrimp_result terrimpi_build_refine(terrimp_terrain *t, uint32_t number, void *scratch,
                                           size_t bytes)
{
    static const float nowhere[3] = {0.0f, 0.0f, 0.0f};
    terrimp_node node = terrimpi_tree_node(&t->tree, number), children[4];
    uint32_t i, count = 0;
    t->mesh_triangle_count -= terrimpi_mesh_triangles(&t->meshes[number]);
    TERRIMPI_TRY(terrimp_terrain_build_node(t, number, scratch, bytes));
    t->mesh_triangle_count += terrimpi_mesh_triangles(&t->meshes[number]);
    if (node.level > 0)
        count = terrimpi_tree_children(&t->tree, &node, nowhere, children);
    for (i = 0; i < count; i++)
        terrimpi_build_hold_node(t, number, children[i].number);
    terrimpi_build_hold(&t->meshes[number], t->tree.nodes[number].low, t->tree.nodes[number].high);
    for (i = number; i + 1u < t->tree.node_count; i = terrimpi_tree_parent_number(&t->tree, i))
        terrimpi_build_hold_node(t, terrimpi_tree_parent_number(&t->tree, i), i);
    t->stale[number / 32u] &= ~(1u << number % 32u);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_terrain_refine(terrimp_terrain *terrain, uint32_t *nodes,
                                                  uint32_t count, uint32_t *done, void *scratch,
                                                  size_t bytes)
{
    uint32_t node;
    TERRIMPI_REFUSE(!terrain || !done, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built || terrain->baked, TERRIMP_E_STATE);
    TERRIMPI_TRY(terrimpi_build_check(terrain, scratch, bytes));
    *done = 0;
    terrain->tree.edits++;
    for (node = 0; node < terrain->tree.node_count && *done < count; node++) {
        if (terrain->stale[node / 32u] == 0)
            node |= 31u;
        if (node >= terrain->tree.node_count || !terrimpi_terrain_stale(terrain, node))
            continue;
        TERRIMPI_TRY(terrimpi_build_refine(terrain, node, scratch, bytes));
        if (nodes)
            nodes[*done] = node;
        ++*done;
    }
    return TERRIMP_OK;
}

static int terrimpi_build_any_stale(const terrimp_terrain *t)
{
    uint32_t i, any = 0;
    for (i = 0; t->stale && i < terrimpi_build_stale_words(t); i++)
        any |= t->stale[i];
    return any != 0;
}

TERRIMP_API terrimp_result terrimp_terrain_rebuild(terrimp_terrain *terrain,
                                                   const terrimp_rect *samples, void *scratch,
                                                   size_t bytes)
{
    uint32_t done;
    TERRIMPI_TRY(terrimpi_terrain_check_touched(terrain, samples));
    TERRIMPI_REFUSE(terrain->baked, TERRIMP_E_STATE);
    TERRIMPI_TRY(terrimpi_build_check(terrain, scratch, bytes));
    TERRIMPI_TRY(terrimp_terrain_edit(terrain, samples));
    return terrimp_terrain_refine(terrain, NULL, terrain->tree.node_count, &done, scratch, bytes);
}

/* ---- a terrain by one call ---- */

#ifndef TERRIMP_NO_MALLOC

TERRIMP_API terrimp_result terrimp_terrain_create(const terrimp_terrain_desc *desc,
                                                  const terrimp_allocator *allocator,
                                                  terrimp_terrain **terrain)
{
    terrimp_allocator from;
    terrimp_terrain_desc resolved;
    terrimp_terrain *made = NULL;
    terrimp_result result;
    size_t bytes, scratch_bytes;
    void *memory, *scratch;
    TERRIMPI_REFUSE(!terrain || !terrimpi_terrain_allocator(allocator, &from), TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_terrain_desc_resolve(desc, &resolved));
    bytes = terrimp_terrain_bytes(&resolved);
    scratch_bytes = terrimp_terrain_scratch_bytes(&resolved);
    TERRIMPI_REFUSE(bytes == 0 || scratch_bytes == 0, TERRIMP_E_OVERFLOW);
    memory = from.allocate(from.user, bytes);
    scratch = from.allocate(from.user, scratch_bytes);
    result = memory && scratch ? terrimp_terrain_init(&resolved, memory, bytes, &made)
                               : TERRIMP_E_MEMORY;
    if (result == TERRIMP_OK)
        result = terrimp_terrain_build(made, scratch, scratch_bytes);
    if (scratch)
        from.release(from.user, scratch, scratch_bytes);
    if (result != TERRIMP_OK) {
        if (memory)
            from.release(from.user, memory, bytes);
        return result;
    }
    made->allocator = from;
    made->bytes = bytes;
    *terrain = made;
    return TERRIMP_OK;
}

#endif /* TERRIMP_NO_MALLOC */

/* ---- materials ---- */

/* The texels that columns or rows of samples from `from` to `to` may read, of `count` over `last`
   quads; with the 1 / 64 that machines round places by. */
static void terrimpi_material_range(uint32_t from, uint32_t to, uint32_t last, uint32_t count,
                                    int centred, float reach, uint32_t range[2])
{
    float scale = (float)(centred ? count - 1u : count) / (float)last;
    float shift = centred ? 0.5f : 0.0f, most = (float)(count - 1u), slack = reach - 0.484375f;
    range[0] = (uint32_t)terrimpi_clamp((float)from * scale + shift - slack, 0.0f, most);
    range[1] = (uint32_t)terrimpi_clamp((float)to * scale + shift + slack, 0.0f, most);
}

/* Whether a material has any weight on a node of level 0. */
static int terrimpi_material_on(const terrimp_quadtree *tree, const terrimp_node *n,
                                const terrimp_weights *w, float reach)
{
    uint32_t last_x = tree->field.width - 1u, last_z = tree->field.depth - 1u;
    uint32_t x = n->x * tree->chunk_quads, z = n->z * tree->chunk_quads, u[2], v[2], i, j;
    size_t step = w->texel_bytes ? w->texel_bytes : 1u;
    size_t row = w->row_bytes ? w->row_bytes : w->width * step;
    terrimpi_material_range(x, terrimpi_min_u32(x + tree->chunk_quads, last_x), last_x, w->width,
                            w->centred, reach, u);
    terrimpi_material_range(z, terrimpi_min_u32(z + tree->chunk_quads, last_z), last_z, w->depth,
                            w->centred, reach, v);
    for (j = v[0]; j <= v[1]; j++)
        for (i = u[0]; i <= u[1]; i++)
            if (w->texels[j * row + i * step])
                return 1;
    return 0;
}

TERRIMP_API terrimp_result terrimp_material_masks(const terrimp_quadtree *tree,
                                                  const terrimp_weights *weights, uint32_t count,
                                                  float reach, uint32_t *masks)
{
    uint32_t i, k;
    TERRIMPI_REFUSE(!tree || !weights || !masks, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite(reach), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!terrimpi_within_u32(count, 1u, 32u) || !terrimpi_within(reach, 1.0f, 65536.0f),
                    TERRIMP_E_RANGE);
    for (k = 0; k < count; k++) {
        TERRIMPI_REFUSE(!weights[k].texels, TERRIMP_E_NULL);
        TERRIMPI_REFUSE(!terrimpi_within_u32(weights[k].width, 1u, 65536u) ||
                        !terrimpi_within_u32(weights[k].depth, 1u, 65536u), TERRIMP_E_RANGE);
    }
    memset(masks, 0, tree->node_count * sizeof *masks);
    for (i = 0; i < tree->node_count; i++) {
        terrimp_node n = terrimpi_tree_node(tree, i);
        for (k = 0; k < count && n.level == 0; k++)
            if (terrimpi_material_on(tree, &n, &weights[k], reach))
                masks[i] |= 1u << k;
        if (n.level + 1u < tree->level_count)
            masks[terrimpi_tree_parent(tree, &n).number] |= masks[i];
    }
    return TERRIMP_OK;
}

/* ---- the bake ---- */

/* The bytes of the arrays, 0 when they and the header pass what 32 bits can count. */
static size_t terrimpi_bake_array_bytes(const terrimp_terrain *t)
{
    terrimp_terrain counted = *t;
    size_t bytes = terrimpi_terrain_layout(&counted, NULL);
    return bytes > 0xffffffffu - sizeof(terrimpi_bake) ? 0 : bytes;
}

TERRIMP_API size_t terrimp_bake_bytes(const terrimp_terrain *terrain)
{
    int any = terrain && terrain->built && terrain->meshes;
    size_t arrays = any ? terrimpi_bake_array_bytes(terrain) : 0;
    return arrays ? sizeof(terrimpi_bake) + arrays : 0;
}

static void terrimpi_bake_swap_words(unsigned char *words, size_t bytes)
{
    size_t i;
    for (i = 0; i + 4u <= bytes; i += 4u) {
        unsigned char first = words[i], second = words[i + 1u];
        words[i] = words[i + 3u];
        words[i + 1u] = words[i + 2u];
        words[i + 2u] = second;
        words[i + 3u] = first;
    }
}

/* Fills in what a header says of a terrain. */
static void terrimpi_bake_describe(const terrimp_terrain *t, terrimpi_bake *bake)
{
    memset(bake, 0, sizeof *bake);
#define TERRIMPI_X(own, of) bake->own = t->of;
    TERRIMPI_BAKE_FIELDS(TERRIMPI_X)
#undef TERRIMPI_X
    bake->flags = (t->desc.no_lower_skirts ? (uint32_t)TERRIMPI_BAKE_NO_LOWER_SKIRTS : 0u) |
                  (t->desc.not_proud ? (uint32_t)TERRIMPI_BAKE_NOT_PROUD : 0u);
}

TERRIMP_API terrimp_result terrimp_bake_write(const terrimp_terrain *terrain, void *out,
                                              size_t bytes, int swapped)
{
    terrimpi_bake bake;
    size_t arrays;
    TERRIMPI_REFUSE(!terrain || !out, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrain->built || !terrain->meshes || terrimpi_build_any_stale(terrain),
                    TERRIMP_E_STATE);
    arrays = terrimpi_bake_array_bytes(terrain);
    TERRIMPI_REFUSE(arrays == 0, TERRIMP_E_OVERFLOW);
    TERRIMPI_REFUSE(bytes < sizeof bake + arrays, TERRIMP_E_CAPACITY);
    TERRIMPI_REFUSE((uintptr_t)out % TERRIMPI_ALIGN != 0, TERRIMP_E_ALIGN);
    terrimpi_bake_describe(terrain, &bake);
    bake.magic = TERRIMPI_BAKE_MAGIC;
    bake.version = TERRIMP_BAKE_VERSION;
    bake.bytes = (uint32_t)(sizeof bake + arrays);
    bake.samples = terrimpi_bake_hash_samples(&terrain->desc.field);
    memcpy(out, &bake, sizeof bake);
    memcpy((unsigned char *)out + sizeof bake, terrain->tree.nodes, arrays); /* all four */
    bake.checksum = terrimpi_bake_hash(out);
    memcpy(out, &bake, sizeof bake);
    if (swapped)
        terrimpi_bake_swap_words((unsigned char *)out, bake.bytes);
    return TERRIMP_OK;
}

/* ==== Page builder ======================================================= >>impl-page-builder */
/* A block is built as a terrain of its own, over a window of the field: of the block, of what its
   nodes look at beyond it, and of the block before it along either axis, so that numbers of nodes
   and places of the lattice differ from those of the whole field by a constant. What lies above the
   blocks is built the same way over a field of every 2^block_level-th sample. */

typedef struct terrimpi_paging {
    const terrimp_pages_desc *desc; /* resolved */
    terrimp_terrain whole;          /* nothing but its numbers */
    terrimpi_pages_head head;       /* of the file, but for what is known at the end */
    uint32_t block_count;
    uint32_t level;                 /* of the whole: of the part's level 0 */
    uint32_t x, z;                  /* the part's first column and row in the whole, in its steps */
    terrimp_terrain *part;
    size_t part_bytes, scratch_bytes;
    unsigned char *samples;         /* of the part */
    float *held;                    /* [nodes of the part] see terrimpi_record */
    float *missed, *squares;        /* [the same] what the ground of the blocks below misses */
    unsigned char *page, *header;
    void *scratch;                  /* of the Builder */
} terrimpi_paging;

TERRIMP_API terrimp_result terrimp_pages_desc_resolve(const terrimp_pages_desc *desc,
                                                      terrimp_pages_desc *out,
                                                      uint32_t *block_count)
{
    static const float any = 0.0f; /* stands for the samples */
    terrimp_pages_desc d;
    terrimp_terrain t;
    uint32_t top;
    TERRIMPI_REFUSE(!desc || !out || !block_count || !desc->read || !desc->load || !desc->store,
                    TERRIMP_E_NULL);
    d = *desc;
    d.terrain.field.samples = &any;
    d.terrain.field.row_bytes = 0;
    memset(&t, 0, sizeof t);
    TERRIMPI_TRY(terrimp_terrain_desc_resolve(&d.terrain, &t.desc));
    TERRIMPI_REFUSE(!terrimpi_terrain_count(&t), TERRIMP_E_OVERFLOW);
    TERRIMPI_REFUSE(!(t.desc.height_low < t.desc.height_high), TERRIMP_E_RANGE);
    top = t.tree.level_count - 1u;
    TERRIMPI_DEFAULT(d.block_level, t.desc.field.width <= 4097u && t.desc.field.depth <= 4097u
                                        ? top : 4u);
    d.block_level = terrimpi_min_u32(d.block_level, top);
    TERRIMPI_DEFAULT(d.morph_ratio, 1.0f);
    TERRIMPI_REFUSE(!terrimpi_within(d.morph_ratio, 1.0f, 4.0f) ||
                    (d.morph_ratio > 1.0f && t.desc.chunk_quads % 4u != 0), TERRIMP_E_RANGE);
    d.terrain = t.desc;
    *block_count = t.tree.level_x[d.block_level] * t.tree.level_z[d.block_level];
    *out = d;
    return TERRIMP_OK;
}

/* Begins a window of columns [x, x + width) and rows of the field at a level's steps; w has its
   descriptor. Sets the arrays when there is a base. */
static size_t terrimpi_paging_layout(terrimpi_paging *w, uint32_t level, const terrimp_rect *r,
                                     unsigned char *base, terrimp_terrain_desc *part)
{
    terrimpi_arena b = terrimpi_arena_at(base);
    terrimp_terrain counted;
    *part = w->desc->terrain;
    part->field.width = r->width;
    part->field.depth = r->height;
    part->field.row_bytes = r->width * terrimpi_field_sample_bytes(part->field.format);
    memset(&counted, 0, sizeof counted);
    counted.desc = *part;
    terrimpi_terrain_count(&counted);
    w->level = level;
    w->x = r->x;
    w->z = r->y;
    w->part_bytes = terrimp_terrain_bytes(part);
    w->scratch_bytes = terrimp_terrain_scratch_bytes(part);
    w->samples = (unsigned char *)terrimpi_take(&b, r->height, part->field.row_bytes);
    w->part = (terrimp_terrain *)terrimpi_take(&b, w->part_bytes, 1);
    w->held = (float *)terrimpi_take(&b, counted.tree.node_count, sizeof *w->held);
    w->missed = (float *)terrimpi_take(&b, counted.tree.node_count, sizeof *w->missed);
    w->squares = (float *)terrimpi_take(&b, counted.tree.node_count, sizeof *w->squares);
    w->page = (unsigned char *)terrimpi_take(&b, terrimpi_page_bytes(&w->whole), 1);
    w->header = (unsigned char *)terrimpi_take(&b, TERRIMP_PAGES_HEADER_BYTES, 1);
    w->scratch = terrimpi_take(&b, w->scratch_bytes, 1);
    part->field.samples = w->samples;
    return b.ok && w->part_bytes && w->scratch_bytes ? b.bytes : 0;
}

/* Along one axis of `last` quads: the window of block k, and what of it is read. */
static void terrimpi_paging_along(uint32_t k, uint32_t quads, uint32_t margin, uint32_t last,
                                  uint32_t *first, uint32_t *count, uint32_t *from)
{
    uint32_t end = terrimpi_min_u32((k + 1u) * quads, last);
    *first = k > 0 ? (k - 1u) * quads : 0u;
    *from = k > 0 ? k * quads - margin : 0u;
    *count = terrimpi_min_u32(margin, last - end) + end - *first + 1u;
}

/* The window of a block; *read gets what of it is to be read. */
static terrimp_rect terrimpi_paging_of(const terrimpi_paging *w, uint32_t block, terrimp_rect *read)
{
    const terrimp_quadtree *t = &w->whole.tree;
    uint32_t level = w->desc->block_level, quads = t->chunk_quads << level;
    terrimp_rect r;
    terrimpi_paging_along(block % t->level_x[level], quads, 1u << level, t->field.width - 1u, &r.x,
                          &r.width, &read->x);
    terrimpi_paging_along(block / t->level_x[level], quads, 1u << level, t->field.depth - 1u, &r.y,
                          &r.height, &read->y);
    read->width = r.x + r.width - read->x;
    read->height = r.y + r.height - read->y;
    return r;
}

/* The field of every 2^block_level-th sample. */
static terrimp_rect terrimpi_paging_end(const terrimpi_paging *w)
{
    uint32_t level = w->desc->block_level;
    return terrimpi_rect(0, 0, ((w->whole.desc.field.width - 2u) >> level) + 2u,
                         ((w->whole.desc.field.depth - 2u) >> level) + 2u);
}

static terrimp_result terrimpi_paging_begin(const terrimp_pages_desc *desc, terrimp_pages_desc *d,
                                            terrimpi_paging *w)
{
    memset(w, 0, sizeof *w);
    TERRIMPI_TRY(terrimp_pages_desc_resolve(desc, d, &w->block_count));
    w->desc = d;
    w->whole.desc = d->terrain;
    terrimpi_terrain_count(&w->whole);
    terrimpi_bake_describe(&w->whole, &w->head.bake);
    w->head.bake.magic = TERRIMPI_PAGES_MAGIC;
    w->head.bake.version = TERRIMP_PAGES_VERSION;
    w->head.bake.bytes = TERRIMP_PAGES_HEADER_BYTES;
    w->head.block_level = d->block_level;
    w->head.morph_ratio = d->morph_ratio;
    w->head.stamp = d->stamp;
    w->head.stamp = terrimpi_page_hash(&w->head, sizeof w->head);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_place(const terrimp_pages_desc *desc, uint32_t first_block,
                                               uint32_t block_count, uint64_t *offset,
                                               uint64_t *bytes)
{
    terrimp_pages_desc d;
    terrimpi_paging w;
    const terrimp_quadtree *t = &w.whole.tree;
    uint32_t page_bytes;
    TERRIMPI_REFUSE(!offset || !bytes, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_paging_begin(desc, &d, &w));
    TERRIMPI_REFUSE(first_block > w.block_count || block_count > w.block_count - first_block,
                    TERRIMP_E_RANGE);
    page_bytes = terrimpi_page_bytes(&w.whole);
    *offset = TERRIMP_PAGES_HEADER_BYTES +
              terrimpi_page_first(t, d.block_level, first_block) * page_bytes;
    *bytes = (uint64_t)block_count * terrimpi_page_full(d.block_level + 1u) * page_bytes;
    return TERRIMP_OK;
}

TERRIMP_API size_t terrimp_pages_scratch_bytes(const terrimp_pages_desc *desc)
{
    terrimp_pages_desc d;
    terrimp_terrain_desc part;
    terrimpi_paging w;
    terrimp_rect r, read;
    size_t block, end;
    if (terrimpi_paging_begin(desc, &d, &w) != TERRIMP_OK)
        return 0;
    r = terrimpi_paging_of(&w, 0, &read); /* the last of two blocks has the larger window */
    r.width = terrimpi_min_u32(w.whole.desc.field.width, 2u * r.width);
    r.height = terrimpi_min_u32(w.whole.desc.field.depth, 2u * r.height);
    block = terrimpi_paging_layout(&w, 0, &r, NULL, &part);
    r = terrimpi_paging_end(&w);
    end = terrimpi_paging_layout(&w, d.block_level, &r, NULL, &part);
    return block == 0 || end == 0 ? 0 : block > end ? block : end;
}

/* Lays a window's terrain out in the scratch. */
static terrimp_result terrimpi_paging_open(terrimpi_paging *w, uint32_t level,
                                           const terrimp_rect *r, void *scratch, size_t bytes)
{
    terrimp_terrain_desc part;
    terrimp_terrain *made;
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes,
                                      terrimpi_paging_layout(w, level, r, NULL, &part)));
    terrimpi_paging_layout(w, level, r, (unsigned char *)scratch, &part);
    TERRIMPI_TRY(terrimp_terrain_init(&part, w->part, w->part_bytes, &made));
    if (level > 0) {
        made->coarse = level;
        made->cut_x = ((r->width - 1u) << level) + 1u - w->whole.desc.field.width;
        made->cut_z = ((r->height - 1u) << level) + 1u - w->whole.desc.field.depth;
    }
    return terrimp_terrain_build_begin(made);
}

/* How far the edge along which a finer neighbour cuts its quads across, in the corner that meets a
   coarser side, is from the ground of the blocks where it crosses their diagonals: from the middle
   of quad (i, j) of a level towards +x and -z, or the other way. */
static float terrimpi_paging_across(const terrimp_quadtree *t, uint32_t level, uint32_t i,
                                    uint32_t j, int on)
{
    const terrimp_heightfield *f = &t->field;
    uint32_t half = 1u << level >> 1, k, x = (i << level) + half, z = (j << level) + half;
    float from = terrimpi_field_sample(f, x, z), most = 0.0f;
    float to = terrimpi_field_sample(f, on ? x + half : x - half, on ? z - half : z + half);
    for (k = 0; k < half; k++) {
        uint32_t a = on ? x + k : x - k - 1u, b = on ? z - k - 1u : z + k;
        float middle = 0.5f * (terrimpi_field_sample(f, a, b) +
                               terrimpi_field_sample(f, a + 1u, b + 1u));
        float line = from + (to - from) * (((float)k + 0.5f) / (float)half);
        most = terrimpi_max(most, terrimpi_abs(line - middle));
    }
    return most;
}

/* How far the ground of a node above the blocks, and what is drawn up to it, is from the blocks'
   own at most, between the samples that both are made of. Two surfaces of triangles are farthest
   apart at a vertex or where edges cross. Edges cross between samples when a neighbour cuts its
   quads across; and in quads that are cut off at the far edge, where both stay within the range of
   the samples. */
static terrimp_result terrimpi_paging_between(const terrimpi_paging *w, const terrimp_node *n,
                                              float *most)
{
    const terrimp_quadtree *t = &w->part->tree, *whole = &w->whole.tree;
    uint32_t level = n->level, all = w->level + level, quads = t->chunk_quads, size = 1u << level;
    uint32_t x = n->x * quads, z = n->z * quads, i, j;
    for (j = z - (z > 0); j <= z + quads; j++)
        for (i = x - (x > 0); i <= x + quads; i++) {
            uint32_t wide = terrimpi_tree_col(whole, all, i + 1u);
            uint32_t deep = terrimpi_tree_row(whole, all, j + 1u);
            float low, high;
            wide -= terrimpi_tree_col(whole, all, i);
            deep -= terrimpi_tree_row(whole, all, j);
            if (wide == 0 || deep == 0)
                continue;
            if (terrimpi_min_u32(wide, deep) >> all == 0) {
                TERRIMPI_TRY(terrimpi_field_range(&t->field,
                                                  terrimpi_rect(i << level, j << level, size + 1u,
                                                                size + 1u), 0, &low, &high));
                *most = terrimpi_max(*most, high - low);
            } else if ((i < x || i == x + quads) != (j < z || j == z + quads)) {
                int on = i < x || j == z + quads;
                *most = terrimpi_max(*most, terrimpi_paging_across(t, level, i, j, on));
            }
        }
    return TERRIMP_OK;
}

/* Builds a node of the part and makes it hold those below it. */
static terrimp_result terrimpi_paging_build(const terrimpi_paging *w, const terrimp_node *n)
{
    terrimp_terrain *t = w->part;
    terrimp_geomip_node *ground = &t->tree.nodes[n->number];
    terrimpi_mesh *mesh = &t->meshes[n->number];
    float *missed = w->missed + n->number, *squares = w->squares + n->number, count = 0.0f;
    float around = 0.0f; /* what the blocks miss in the node and where neighbours meet it */
    terrimp_node child, beyond;
    uint32_t i;
    int side;
    TERRIMPI_TRY(terrimp_terrain_build_node(t, n->number, w->scratch, w->scratch_bytes));
    w->held[n->number] = *missed = *squares = 0.0f;
    for (i = 0; i < 4u && w->level > 0; i++) {
        if (!terrimpi_tree_quarter(&t->tree, n, i, &child))
            continue;
        *missed = terrimpi_max(*missed, w->missed[child.number]);
        *squares += w->squares[child.number];
        count += 1.0f;
        for (side = 0; side < (int)TERRIMP_SIDE_COUNT; side++)
            if (terrimpi_tree_beyond(&t->tree, &child, side, &beyond))
                around = terrimpi_max(around, w->missed[beyond.number]);
    }
    if (w->level > 0) {
        *squares /= count;
        TERRIMPI_TRY(terrimpi_paging_between(w, n, &ground->error));
        ground->error += terrimpi_max(*missed, around);
        ground->rms = TERRIMP_SQRTF(ground->rms * ground->rms + *squares);
        mesh->error += *missed;
        mesh->error_rms = TERRIMP_SQRTF(mesh->error_rms * mesh->error_rms + *squares);
    }
    w->held[n->number] = ground->rms;
    for (i = 0; i < 4u; i++) {
        if (!terrimpi_tree_quarter(&t->tree, n, i, &child))
            continue;
        terrimpi_build_hold_node(t, n->number, child.number);
        w->held[n->number] = terrimpi_max(w->held[n->number],
                                          terrimpi_page_held_by(w->desc->morph_ratio,
                                                                w->held[child.number]));
    }
    terrimpi_build_hold(mesh, ground->low, ground->high);
    return TERRIMP_OK;
}

static terrimpi_record terrimpi_paging_record(const terrimpi_paging *w, uint32_t node)
{
    terrimpi_record r;
    r.ground = w->part->tree.nodes[node];
    r.mesh = w->part->meshes[node];
    r.held = w->held[node];
    return r;
}

/* Copies the samples of a node of the part into the page, or out of it. */
static void terrimpi_paging_copy(const terrimpi_paging *w, const terrimp_node *n, int out)
{
    const terrimp_quadtree *t = &w->part->tree;
    size_t size = terrimpi_field_sample_bytes(t->field.format);
    unsigned char *page = w->page + TERRIMPI_PAGE_CHILDREN + 4u * TERRIMPI_PAGE_RECORD +
                          4u * w->whole.vertex_limit + w->whole.index_limit;
    uint32_t i, j, quads = t->chunk_quads;
    for (j = 0; j <= quads; j++)
        for (i = 0; i <= quads; i++, page += size) {
            uint32_t x = terrimpi_tree_col(t, n->level, n->x * quads + i);
            uint32_t z = terrimpi_tree_row(t, n->level, n->z * quads + j);
            unsigned char *sample = w->samples + ((size_t)z * t->field.width + x) * size;
            memcpy(out ? sample : page, out ? page : sample, size);
        }
}

/* The node of the whole that a node of the part is. */
static terrimp_node terrimpi_paging_whole(const terrimpi_paging *w, const terrimp_node *n)
{
    uint32_t side = w->part->tree.chunk_quads << n->level;
    return terrimpi_tree_at(&w->whole.tree, w->level + n->level, n->x + w->x / side,
                            n->z + w->z / side);
}

/* Makes and stores the page of a node of the part. */
static terrimp_result terrimpi_paging_store(const terrimpi_paging *w, const terrimp_node *n)
{
    const terrimp_terrain *t = w->part;
    terrimp_node whole = terrimpi_paging_whole(w, n);
    uint32_t bytes = terrimpi_page_bytes(&w->whole), i, at = TERRIMPI_PAGE_CHILDREN;
    terrimpi_page_head head;
    memset(w->page, 0, bytes);
    head.stamp = w->head.stamp;
    head.node = whole.number;
    head.record = terrimpi_paging_record(w, n->number);
    for (i = 0; i < 4u; i++, at += TERRIMPI_PAGE_RECORD) {
        terrimp_node child;
        terrimpi_record r;
        if (!terrimpi_tree_quarter(&t->tree, n, i, &child))
            continue;
        r = terrimpi_paging_record(w, child.number);
        memcpy(w->page + at, &r, sizeof r);
    }
    memcpy(w->page + at, terrimpi_points_of(t, n->number), 4u * t->vertex_limit);
    at += 4u * t->vertex_limit;
    memcpy(w->page + at, terrimpi_corners_of(t, n->number), t->index_limit);
    terrimpi_paging_copy(w, n, 0);
    memcpy(w->page, &head, sizeof head);
    head.checksum = terrimpi_page_hash(w->page, bytes);
    memcpy(w->page, &head.checksum, sizeof head.checksum);
    return w->desc->store(w->desc->user,
                          terrimpi_page_offset(&w->whole, w->desc->block_level, &whole), w->page,
                          bytes) ? TERRIMP_OK : TERRIMP_E_PAGE;
}

/* The nodes of a level of a rectangle of blocks: from the top down to the finest, or up again. */
static terrimp_result terrimpi_paging_each(const terrimpi_paging *w, uint32_t level, uint32_t top,
                                           uint32_t x, uint32_t z,
                                           terrimp_result (*act)(const terrimpi_paging *w,
                                                                 const terrimp_node *n))
{
    const terrimp_quadtree *t = &w->part->tree;
    uint32_t side = 1u << (top - level), i, j;
    for (j = z * side; j < (z + 1u) * side; j++)
        for (i = x * side; i < (x + 1u) * side; i++)
            if (terrimpi_tree_has(t, level, i, j)) {
                terrimp_node n = terrimpi_tree_at(t, level, i, j);
                TERRIMPI_TRY(act(w, &n));
            }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_pages_build_block(const terrimp_pages_desc *desc, uint32_t block,
                                                     void *scratch, size_t bytes)
{
    terrimp_pages_desc d;
    terrimpi_paging w;
    terrimp_rect r, read;
    uint32_t level, x, z, size;
    TERRIMPI_TRY(terrimpi_paging_begin(desc, &d, &w));
    x = block % w.whole.tree.level_x[d.block_level];
    z = block / w.whole.tree.level_x[d.block_level];
    TERRIMPI_REFUSE(block >= w.block_count, TERRIMP_E_RANGE);
    r = terrimpi_paging_of(&w, block, &read);
    TERRIMPI_TRY(terrimpi_paging_open(&w, 0, &r, scratch, bytes));
    size = (uint32_t)terrimpi_field_sample_bytes(d.terrain.field.format);
    TERRIMPI_REFUSE(!d.read(d.user, read.x, read.y, read.width, read.height,
                            w.samples + ((size_t)(read.y - r.y) * r.width + (read.x - r.x)) * size,
                            (size_t)r.width * size), TERRIMP_E_PAGE);
    x = x > 0;
    z = z > 0;
    for (level = 0; level <= d.block_level; level++)
        TERRIMPI_TRY(terrimpi_paging_each(&w, level, d.block_level, x, z, terrimpi_paging_build));
    for (level = 0; level <= d.block_level; level++)
        TERRIMPI_TRY(terrimpi_paging_each(&w, level, d.block_level, x, z, terrimpi_paging_store));
    return TERRIMP_OK;
}

/* Loads the page of a node and looks at what is told by it alone. */
static terrimp_result terrimpi_paging_load(const terrimpi_paging *w, const terrimp_node *n,
                                           unsigned char *page, terrimpi_page_head *head)
{
    uint32_t bytes = terrimpi_page_bytes(&w->whole);
    TERRIMPI_REFUSE(!w->desc->load(w->desc->user,
                                   terrimpi_page_offset(&w->whole, w->desc->block_level, n), page,
                                   bytes), TERRIMP_E_PAGE);
    memcpy(head, page, sizeof *head);
    return head->checksum == terrimpi_page_hash(page, bytes) && head->stamp == w->head.stamp &&
                   head->node == n->number ? TERRIMP_OK : TERRIMP_E_BAKE;
}

TERRIMP_API terrimp_result terrimp_pages_check_block(const terrimp_pages_desc *desc,
                                                     uint32_t block, void *scratch, size_t bytes)
{
    terrimp_pages_desc d;
    terrimpi_paging w;
    terrimpi_page_head head;
    terrimp_node n;
    uint32_t across;
    TERRIMPI_TRY(terrimpi_paging_begin(desc, &d, &w));
    TERRIMPI_REFUSE(block >= w.block_count, TERRIMP_E_RANGE);
    across = w.whole.tree.level_x[d.block_level];
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes, terrimpi_page_bytes(&w.whole)));
    n = terrimpi_tree_at(&w.whole.tree, d.block_level, block % across, block / across);
    return terrimpi_paging_load(&w, &n, (unsigned char *)scratch, &head);
}

/* Takes over what a block's topmost page says: the part's level 0. */
static terrimp_result terrimpi_paging_take(const terrimpi_paging *w, const terrimp_node *n)
{
    terrimp_node whole = terrimpi_paging_whole(w, n);
    terrimpi_page_head head;
    TERRIMPI_TRY(terrimpi_paging_load(w, &whole, w->page, &head));
    terrimpi_paging_copy(w, n, 1);
    w->part->tree.nodes[n->number] = head.record.ground;
    w->part->meshes[n->number] = head.record.mesh;
    w->held[n->number] = head.record.held;
    w->missed[n->number] = head.record.ground.error;
    w->squares[n->number] = head.record.ground.rms * head.record.ground.rms;
    return TERRIMP_OK;
}

/* The lowest sample below one of the floor's walls, through `read`. */
static terrimp_result terrimpi_paging_lowest(const terrimpi_paging *w, uint32_t wall,
                                             float *lowest)
{
    terrimp_rect r = terrimpi_floor_wall(&w->whole, wall);
    terrimp_heightfield f = w->desc->terrain.field;
    terrimpi_field_scan scan;
    float line[256]; /* of any format */
    uint32_t k, along_x = r.width > 1u;
    for (k = 0; k < r.width * r.height; k += 256u) {
        f.width = along_x ? terrimpi_min_u32(r.width - k, 256u) : 1u;
        f.depth = along_x ? 1u : terrimpi_min_u32(r.height - k, 256u);
        f.row_bytes = f.width * terrimpi_field_sample_bytes(f.format);
        f.samples = line;
        TERRIMPI_REFUSE(!w->desc->read(w->desc->user, along_x ? r.x + k : r.x,
                                       along_x ? r.y : r.y + k, f.width, f.depth, line,
                                       f.row_bytes), TERRIMP_E_PAGE);
        scan.skip_voids = 0;
        TERRIMPI_TRY(terrimpi_field_scan_tile(&f, 0, 0, f.width, f.depth, 1, &scan));
        *lowest = terrimpi_min(*lowest, terrimpi_field_world_height(&f, scan.low));
    }
    return TERRIMP_OK;
}

/* The heights of the floor's corners and walls: see terrimpi_floor_write. */
static terrimp_result terrimpi_paging_floor(const terrimpi_paging *w, float *lows)
{
    const terrimp_terrain *t = &w->whole;
    uint32_t level = t->floor_level, wide = t->tree.level_x[level], deep = t->tree.level_z[level];
    uint32_t i, k, x, z, points = terrimpi_floor_of(t).wall_points;
    terrimpi_page_head head;
    for (i = 0; i < terrimpi_floor_of(t).ground_vertices + points; i++)
        lows[i] = TERRIMPI_FLOAT_MAX;
    for (z = 0; z < deep; z++)
        for (x = 0; x < wide; x++) {
            terrimp_node n = terrimpi_tree_at(&t->tree, level, x, z);
            TERRIMPI_TRY(terrimpi_paging_load(w, &n, w->page, &head));
            for (k = 0; k < 4u; k++) {
                float *corner = lows + (z + k / 2u) * (wide + 1u) + x + k % 2u;
                *corner = terrimpi_min(*corner, head.record.ground.low);
            }
        }
    lows += terrimpi_floor_of(t).ground_vertices;
    for (k = 0; k < points; k++) {
        TERRIMPI_TRY(terrimpi_paging_lowest(w, k + points - 1u, &lows[k]));
        TERRIMPI_TRY(terrimpi_paging_lowest(w, k, &lows[k]));
    }
    return TERRIMP_OK;
}

/* Makes and stores the header. */
static terrimp_result terrimpi_paging_header(const terrimpi_paging *w)
{
    terrimp_node root = terrimpi_tree_root(&w->whole.tree);
    terrimpi_pages_head head = w->head;
    terrimpi_page_head top;
    memset(w->header, 0, TERRIMP_PAGES_HEADER_BYTES);
    TERRIMPI_TRY(terrimpi_paging_floor(w, (float *)(void *)(w->header + sizeof head)));
    TERRIMPI_TRY(terrimpi_paging_load(w, &root, w->page, &top));
    head.bake.sample_low = w->part->sample_low;
    head.bake.sample_high = w->part->sample_high;
    head.bake.range_low = w->part->range_low;
    head.bake.range_step = w->part->range_step;
    head.root = top.record;
    memcpy(w->header, &head, sizeof head);
    head.bake.checksum = terrimpi_bake_hash(w->header);
    memcpy(w->header, &head, sizeof head);
    return w->desc->store(w->desc->user, 0, w->header, TERRIMP_PAGES_HEADER_BYTES)
               ? TERRIMP_OK : TERRIMP_E_PAGE;
}

TERRIMP_API terrimp_result terrimp_pages_build_end(const terrimp_pages_desc *desc, void *scratch,
                                                   size_t bytes)
{
    terrimp_pages_desc d;
    terrimpi_paging w;
    terrimp_rect r;
    uint32_t level, top;
    TERRIMPI_TRY(terrimpi_paging_begin(desc, &d, &w));
    r = terrimpi_paging_end(&w);
    top = w.whole.tree.level_count - 1u - d.block_level;
    TERRIMPI_TRY(terrimpi_paging_open(&w, d.block_level, &r, scratch, bytes));
    TERRIMPI_TRY(terrimpi_paging_each(&w, 0, top, 0, 0, terrimpi_paging_take));
    for (level = 1; level <= top; level++)
        TERRIMPI_TRY(terrimpi_paging_each(&w, level, top, 0, 0, terrimpi_paging_build));
    for (level = 1; level <= top; level++)
        TERRIMPI_TRY(terrimpi_paging_each(&w, level, top, 0, 0, terrimpi_paging_store));
    return terrimpi_paging_header(&w);
}

/* ==== Visible sets ======================================================= >>impl-visible-sets */

/* ---- walls ---- */

/* A node whose walls are built. */
typedef struct terrimpi_wall_site {
    terrimp_walls walls;
    terrimp_node node;
} terrimpi_wall_site;

/* The lowest or the highest of some samples, cut at the far edges. */
static float terrimpi_wall_sample(const terrimpi_wall_site *s, uint32_t x, uint32_t z,
                                  uint32_t cols, uint32_t rows, int highest)
{
    const terrimp_heightfield *field = &s->walls.tree->field;
    float low = 0.0f, high = 0.0f;
    x = terrimpi_min_u32(x, field->width - 1u);
    z = terrimpi_min_u32(z, field->depth - 1u);
    (void)terrimpi_field_range(field, terrimpi_rect(x, z, cols, rows), 1, &low, &high);
    return highest ? high : low;
}

/* The lowest sample of a cell of a line, at level 0. */
static float terrimpi_wall_lowest(const terrimpi_wall_site *s, uint32_t axis, uint32_t row,
                                  uint32_t cell)
{
    uint32_t chunk = s->walls.tree->chunk_quads, quads = s->walls.quads;
    uint32_t x = s->node.x * chunk + (axis == 0 ? row : cell) * quads;
    uint32_t z = s->node.z * chunk + (axis == 0 ? cell : row) * quads;
    return terrimpi_wall_sample(s, x, z, axis == 0 ? 1u : quads + 1u, axis == 0 ? quads + 1u : 1u,
                                0);
}

/* The lowest height of a cell: above level 0 of the two that its children have there; FLOAT_MAX
   where there is no child. */
static float terrimpi_wall_low(const terrimpi_wall_site *s, uint32_t axis, uint32_t row,
                               uint32_t cell)
{
    const uint32_t cells = s->walls.cells;
    uint32_t line = 2u * row, k;
    float lowest = TERRIMPI_FLOAT_MAX;
    if (s->node.level == 0)
        return terrimpi_wall_lowest(s, axis, row, cell);
    for (k = 2u * cell; k <= 2u * cell + 1u; k++) {
        uint32_t x = 2u * s->node.x + (axis == 0 ? line : k) / cells;
        uint32_t z = 2u * s->node.z + (axis == 0 ? k : line) / cells;
        const unsigned char *codes;
        float scale[2];
        if (!terrimpi_tree_has(s->walls.tree, s->node.level - 1u, x, z))
            continue;
        codes = terrimpi_walls_codes(&s->walls, terrimpi_tree_at(
                                         s->walls.tree, s->node.level - 1u, x, z).number, scale);
        lowest = terrimpi_min(lowest, scale[0] + scale[1] * (float)codes[(axis * cells +
                                              line % cells) * cells + k % cells]);
    }
    return lowest;
}

/* The highest sample of one of the 4 x 4 squares of a node at level 0. */
static float terrimpi_wall_highest(const terrimpi_wall_site *s, uint32_t x, uint32_t z)
{
    uint32_t quads = s->walls.tree->chunk_quads;
    uint32_t size = (quads + TERRIMPI_WALL_TOPS - 1u) / TERRIMPI_WALL_TOPS + 1u;
    return terrimpi_wall_sample(s, s->node.x * quads + x * quads / TERRIMPI_WALL_TOPS,
                                s->node.z * quads + z * quads / TERRIMPI_WALL_TOPS, size, size, 1);
}

/* The highest height of a square; -FLOAT_MAX where there is no child. */
static float terrimpi_wall_top(const terrimpi_wall_site *s, uint32_t square)
{
    uint32_t x = square % TERRIMPI_WALL_TOPS, z = square / TERRIMPI_WALL_TOPS, k;
    uint32_t child_x = 2u * s->node.x + x / 2u, child_z = 2u * s->node.z + z / 2u;
    const unsigned char *codes;
    float scale[2];
    uint8_t highest = 0;
    if (s->node.level == 0)
        return terrimpi_wall_highest(s, x, z);
    if (!terrimpi_tree_has(s->walls.tree, s->node.level - 1u, child_x, child_z))
        return -TERRIMPI_FLOAT_MAX;
    codes = terrimpi_walls_tops(&s->walls, terrimpi_tree_at(s->walls.tree, s->node.level - 1u,
                                                            child_x, child_z).number, scale);
    for (k = 0; k < 4u; k++) {
        uint32_t i = (x % 2u) * 2u + k % 2u, j = (z % 2u) * 2u + k / 2u;
        if (codes[j * TERRIMPI_WALL_TOPS + i] > highest)
            highest = codes[j * TERRIMPI_WALL_TOPS + i];
    }
    return scale[0] + scale[1] * (float)highest;
}

/* Code k of a node as a height: first the walls, then the squares. */
static float terrimpi_wall_value(const terrimpi_wall_site *s, uint32_t k)
{
    const uint32_t cells = s->walls.cells;
    if (k >= 2u * cells * cells)
        return terrimpi_wall_top(s, k - 2u * cells * cells);
    return terrimpi_wall_low(s, k / (cells * cells), k / cells % cells, k % cells);
}

/* The code of a height, rounded down for walls and up for squares. */
static unsigned char terrimpi_wall_code(float value, const float scale[2], int up)
{
    float steps = scale[1] > 0.0f ? (value - scale[0]) / scale[1] : 0.0f;
    uint32_t code = (uint32_t)terrimpi_clamp(steps, 0.0f, 255.0f);
    while (!up && code > 0 && scale[0] + scale[1] * (float)code > value)
        code--;
    while (up && code < 255u && scale[0] + scale[1] * (float)code < value)
        code++;
    return (unsigned char)code;
}

static void terrimpi_wall_build(const terrimp_quadtree *tree, terrimp_node node,
                                unsigned char *walls)
{
    terrimpi_wall_site s;
    unsigned char *codes;
    uint32_t k, count;
    float low = TERRIMPI_FLOAT_MAX, high = -TERRIMPI_FLOAT_MAX, scale[2];
    s.walls = terrimpi_walls_of(tree, walls);
    s.node = node;
    codes = walls + (size_t)node.number * s.walls.stride;
    memset(codes, 0, s.walls.stride);
    count = 2u * s.walls.cells * s.walls.cells;
    for (k = 0; k < count + TERRIMPI_WALL_TOPS * TERRIMPI_WALL_TOPS; k++) {
        float value = terrimpi_wall_value(&s, k);
        if (k < count)
            low = terrimpi_min(low, value);
        if (terrimpi_abs(value) < TERRIMPI_FLOAT_MAX)
            high = terrimpi_max(high, value);
    }
    scale[0] = low;
    scale[1] = high * (1.0f / 255.0f) - low * (1.0f / 255.0f);
    memcpy(codes, scale, sizeof scale);
    codes += sizeof scale;
    for (k = 0; k < count + TERRIMPI_WALL_TOPS * TERRIMPI_WALL_TOPS; k++)
        codes[k] = terrimpi_wall_code(terrimpi_wall_value(&s, k), scale, k >= count);
}

TERRIMP_API terrimp_result terrimp_walls_build_node(const terrimp_quadtree *tree, uint32_t node,
                                                    void *walls)
{
    TERRIMPI_TRY(terrimpi_walls_check(tree, walls));
    TERRIMPI_REFUSE(node >= tree->node_count, TERRIMP_E_RANGE);
    terrimpi_wall_build(tree, terrimpi_tree_node(tree, node), (unsigned char *)walls);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_walls_build(const terrimp_quadtree *tree,
                                               const terrimp_rect *samples, void *walls)
{
    const terrimp_rect all = {0, 0, TERRIMP_MAX_DIM, TERRIMP_MAX_DIM};
    uint32_t level, x, z;
    samples = samples ? samples : &all;
    TERRIMPI_TRY(terrimpi_walls_check(tree, walls));
    TERRIMPI_REFUSE(!terrimpi_field_has(&tree->field, samples), TERRIMP_E_RANGE);
    for (level = 0; level < tree->level_count; level++) {
        terrimpi_terrain_touched in = terrimpi_terrain_touched_within(tree, samples, level, 0);
        for (z = in.z0; z <= in.z1; z++)
            for (x = in.x0; x <= in.x1; x++)
                terrimpi_wall_build(tree, terrimpi_tree_at(tree, level, x, z),
                                    (unsigned char *)walls);
    }
    return TERRIMP_OK;
}

/* ---- visible sets ---- */
/* What sees a point sees it from farther up, too: the upper sight line is above the lower one all
   the way, so it clears the terrain. So for a cell and a node there is one least height.

   A lower bound of it: take eyes in a rectangle, points of a height of at most Y in another one,
   and a row of samples between the two. A sight line crosses the row at a part t of its way, of a
   range that follows from the rectangles, and within an interval; the ground is nowhere lower there
   than m, the lowest wall of the interval. It clears the row only if y (1 - t) + Y t >= m, so an
   eye below (m - Y t) / (1 - t), which is monotone in t, is too low, whatever the line. Of all rows
   of both axes the one that asks most counts. Cutting both rectangles makes intervals narrow and Y
   low; the least of all pairs of parts is that of the whole. A part that a row proves to need more
   than the least so far need not be looked at closer: mostly it is the row of the part before.

   An eye has to be above the ground; ground that z_near clips is seen to in the look-up. What is
   drawn off its samples by `low` is so both where it hides (m is lowered) and where it is hidden (Y
   is raised); and the two lie no more than `error` times the distance of m off each other. */

/* [quads] */
typedef struct terrimpi_sets_rect {
    float low[2], high[2];
} terrimpi_sets_rect;

typedef struct terrimpi_sets_job {
    const terrimp_sets *sets;
    terrimp_walls walls;
    terrimpi_sets_rect cell, node;
    float ground[16], tops[16]; /* of 4 x 4 parts of the two: lowest, highest heights */
    float base, low, rounding;  /* base: the lowest of the cell */
    uint32_t line[2], axis;     /* that asked most, the last time */
} terrimpi_sets_job;

/* Sight lines between two rectangles along an axis. */
typedef struct terrimpi_sets_shaft {
    terrimpi_sets_rect eye, to;
    float top, off;        /* Y; what m is lowered by at the end of the way */
    uint32_t axis, level;  /* of the walls */
    uint32_t first, count; /* lines that are crossed, in steps of */
    uint32_t apart;
    float start, sign;     /* where the eyes' rectangle ends */
    float wide, inverse[2]; /* its size; over the longest way from its end, the shortest from its
                              beginning */
} terrimpi_sets_shaft;

/* Lays a shaft along an axis. Returns 0 when no line of it is between the two. */
static int terrimpi_sets_along(const terrimpi_sets_job *b, terrimpi_sets_shaft *s, uint32_t axis,
                               uint32_t level)
{
    const float *from, *to;
    float gap, a, z;
    int forward = s->to.low[axis] >= s->eye.high[axis];
    if (!forward && s->to.high[axis] > s->eye.low[axis])
        return 0;
    from = forward ? s->eye.high : s->eye.low;
    to = forward ? s->to.low : s->to.high;
    s->axis = axis;
    s->level = terrimpi_min_u32(level, b->walls.tree->level_count - 1u);
    s->apart = b->walls.quads << s->level;
    s->start = from[axis];
    s->sign = forward ? 1.0f : -1.0f;
    s->wide = s->eye.high[axis] - s->eye.low[axis];
    gap = s->sign * (to[axis] - s->start);
    s->inverse[0] = 1.0f / (gap + (s->to.high[axis] - s->to.low[axis]));
    s->inverse[1] = 1.0f / (gap + s->wide);
    a = terrimpi_max(terrimpi_min(from[axis], to[axis]), 0.0f);
    z = terrimpi_max(from[axis], to[axis]);
    s->first = terrimpi_ceil_u32(a / (float)s->apart);
    s->count = (uint32_t)(z / (float)s->apart) + 1u;
    s->count -= terrimpi_min_u32(s->first, s->count);
    return s->count > 0;
}

/* The least height of an eye that one line of a shaft asks for. */
static float terrimpi_sets_line(const terrimpi_sets_job *b, const terrimpi_sets_shaft *s,
                                uint32_t line)
{
    uint32_t other = 1u - s->axis, row = line / s->apart;
    uint32_t quads = terrimpi_stand_last(b->walls.tree, other) - 1u, i, j;
    float way = s->sign * ((float)line - s->start), t[2], low, high, m, at;
    float eye_low = s->eye.low[other], to_low = s->to.low[other] - eye_low;
    float eye_high = s->eye.high[other], to_high = s->to.high[other] - eye_high;
    t[0] = way * s->inverse[0];
    t[1] = (way + s->wide) * s->inverse[1];
    low = eye_low + terrimpi_min(to_low * t[0], to_low * t[1]) - b->rounding;
    high = eye_high + terrimpi_max(to_high * t[0], to_high * t[1]) + b->rounding;
    i = (uint32_t)terrimpi_max(low, 0.0f);
    j = terrimpi_min_u32((uint32_t)high, quads);
    m = terrimpi_walls_lowest(&b->walls, s->axis, s->level, row / b->walls.cells,
                              row % b->walls.cells, i, j) - b->low - s->off * t[1];
    at = m > s->top ? t[0] : t[1];
    return at < 1.0f ? (m - s->top * at) / (1.0f - at) : TERRIMPI_HORIZON_NONE;
}

/* The least height that lines ask for, `least` or more; it need not be found once it is `enough`.
   First the lines round those that asked most before, then all lines of the walls two levels up,
   then those of finer ones round what asks most. */
static float terrimpi_sets_least(terrimpi_sets_job *b, terrimpi_sets_shaft *s, uint32_t level,
                                 float least, float enough)
{
    uint32_t turn, k, axis = b->axis;
    for (turn = 0; turn < 8u && least < enough; turn++) {
        uint32_t all = turn / 2u == 1u, coarser = turn < 2u ? 0u : 3u - turn / 2u, around;
        if (!terrimpi_sets_along(b, s, (axis ^ turn) & 1u, level + coarser))
            continue;
        around = terrimpi_clamp_u32(b->line[s->axis] / s->apart, s->first,
                                    s->first + s->count - 1u);
        for (k = 0; k < (all ? 2u * s->count : 3u) && least < enough; k++) {
            uint32_t n = around - s->first + (k % 2u ? 0u - (k + 1u) / 2u : k / 2u);
            float asked;
            if (n >= s->count) /* below 0 it becomes large */
                continue;
            asked = terrimpi_sets_line(b, s, (s->first + n) * s->apart);
            if (asked > least) {
                least = asked;
                b->line[s->axis] = (s->first + n) * s->apart;
                b->axis = s->axis;
            }
        }
    }
    return least;
}

/* Part (x, z) of a rectangle's 4 x 4, and those beside it: `size` along a side. */
static terrimpi_sets_rect terrimpi_sets_part(const terrimpi_sets_job *b,
                                             const terrimpi_sets_rect *of, const uint32_t at[2],
                                             uint32_t size)
{
    terrimpi_sets_rect r;
    uint32_t k;
    for (k = 0; k < 2u; k++) {
        float last = (float)terrimpi_stand_last(b->walls.tree, k);
        float part = 0.25f * (of->high[k] - of->low[k]);
        r.low[k] = terrimpi_min(of->low[k] + part * (float)at[k], last) - b->rounding;
        r.high[k] = terrimpi_min(of->low[k] + part * (float)(at[k] + size), last) + b->rounding;
    }
    return r;
}

/* The highest of the same parts; of negative values the lowest. */
static float terrimpi_sets_most(const float values[16], const uint32_t at[2], uint32_t size,
                                float sign)
{
    uint32_t i;
    float most = TERRIMPI_HORIZON_NONE;
    for (i = 0; i < size * size; i++)
        most = terrimpi_max(most, sign * values[(at[1] + i / size) * 4u + at[0] + i % size]);
    return sign * most;
}

/* The least height of an eye in some parts of the cell that sees some of the node; `least` is known
   of all parts that hold these. Returns the lesser one of it and `best`. */
static float terrimpi_sets_search(terrimpi_sets_job *b, const uint32_t eye[2], const uint32_t to[2],
                                  uint32_t size, float least, float best)
{
    const terrimp_quadtree *tree = b->walls.tree;
    const terrimp_heightfield *field = &tree->field;
    terrimpi_sets_shaft s;
    float top = terrimpi_sets_most(b->tops, to, size, 1.0f), x, z, up;
    uint32_t k, half = size / 2u;
    least = terrimpi_max(least, terrimpi_sets_most(b->ground, eye, size, -1.0f));
    if (least >= best)
        return best;
    s.eye = terrimpi_sets_part(b, &b->cell, eye, size);
    s.to = terrimpi_sets_part(b, &b->node, to, size);
    x = terrimpi_max(s.to.high[0] - s.eye.low[0], s.eye.high[0] - s.to.low[0]) * field->spacing_x;
    z = terrimpi_max(s.to.high[1] - s.eye.low[1], s.eye.high[1] - s.to.low[1]) * field->spacing_z;
    up = terrimpi_max(best, top) - tree->nodes[tree->node_count - 1u].low;
    s.off = b->sets->error * TERRIMP_SQRTF(x * x + z * z + up * up);
    s.top = top + b->low;
    least = terrimpi_sets_least(b, &s, terrimpi_min_u32(b->sets->cell_level, b->sets->node_level) +
                                           half, least, best); /* 4, 2, 1 parts: 2, 1, 0 */
    if (least >= best)
        return best;
    if (size == 1u) /* rounded to codes, the rest need not be looked at any closer */
        return terrimpi_sets_height(b->sets, b->base, terrimpi_sets_code(b->sets, b->base, least));
    for (k = 0; k < 16u; k++) {
        uint32_t eye_part[2], to_part[2];
        eye_part[0] = eye[0] + (k & 1u) * half;
        eye_part[1] = eye[1] + (k >> 1 & 1u) * half;
        to_part[0] = to[0] + (k >> 2 & 1u) * half;
        to_part[1] = to[1] + (k >> 3) * half;
        best = terrimpi_sets_search(b, eye_part, to_part, half, least, best);
    }
    return best;
}

/* What a node of a level covers, also beyond the far edges. */
static terrimpi_sets_rect terrimpi_sets_place(const terrimp_quadtree *tree, const terrimp_node *n)
{
    float quads = (float)(tree->chunk_quads << n->level);
    terrimpi_sets_rect r;
    r.low[0] = (float)n->x * quads;
    r.low[1] = (float)n->z * quads;
    r.high[0] = r.low[0] + quads;
    r.high[1] = r.low[1] + quads;
    return r;
}

/* Whether sight lines between two squares can meet quads round some samples: all are within half of
   the larger square's side of the line between their middles. */
static int terrimpi_sets_meets(const terrimpi_sets_rect *a, const terrimpi_sets_rect *b,
                               const terrimp_rect *samples)
{
    float wide = 0.5f * terrimpi_max(a->high[0] - a->low[0], b->high[0] - b->low[0]) + 1.5f;
    float from = 0.0f, to = 1.0f;
    uint32_t k;
    for (k = 0; k < 2u; k++) {
        float start = 0.5f * (a->low[k] + a->high[k]);
        float way = 0.5f * (b->low[k] + b->high[k]) - start;
        float low = (float)(k == 0 ? samples->x : samples->y) - wide - start;
        float high = low + 2.0f * wide + (float)(k == 0 ? samples->width : samples->height);
        if (terrimpi_abs(way) < 0.5f) {
            if (low > 0.0f || high < 0.0f)
                return 0;
            continue;
        }
        from = terrimpi_max(from, terrimpi_min(low / way, high / way) - 1e-4f);
        to = terrimpi_min(to, terrimpi_max(low / way, high / way) + 1e-4f);
    }
    return from <= to;
}

/* Works on the codes of a cell that some samples can change: builds them, or without a job that has
   walls forgets them. */
static void terrimpi_sets_row(terrimpi_sets_job *b, const terrimp_node *cell,
                              const terrimp_rect *samples)
{
    const terrimp_sets *sets = b->sets;
    const terrimp_quadtree *tree = sets->hider.tree;
    uint32_t first = tree->level_first[sets->node_level], i, k, zero[2] = {0, 0};
    uint32_t count = terrimpi_sets_level_nodes(tree, sets->node_level);
    uint8_t *row = sets->codes +
                   (size_t)(cell->number - tree->level_first[cell->level]) * count;
    float most = terrimpi_sets_height(sets, b->base, 255u);
    for (i = 0; i < count; i++) {
        terrimp_node node = terrimpi_tree_node(tree, first + i);
        const unsigned char *tops;
        float scale[2];
        b->node = terrimpi_sets_place(tree, &node);
        if (samples && !terrimpi_sets_meets(&b->cell, &b->node, samples))
            continue;
        row[i] = 0;
        if (!b->walls.codes)
            continue;
        b->line[0] = b->line[1] = b->axis = 0; /* the same code, whatever was built before */
        tops = terrimpi_walls_tops(&b->walls, node.number, scale);
        for (k = 0; k < 16u; k++)
            b->tops[k] = terrimpi_min(scale[0] + scale[1] * (float)tops[k],
                                      tree->nodes[node.number].high);
        row[i] = (uint8_t)terrimpi_sets_code(
            sets, b->base, terrimpi_sets_search(b, zero, zero, 4u, b->base, most));
    }
}

TERRIMP_API terrimp_result terrimp_sets_build_cell(const terrimp_sets *sets, const void *walls,
                                                   uint32_t cell, const terrimp_rect *samples)
{
    const terrimp_quadtree *tree;
    terrimpi_sets_job b;
    terrimp_node node;
    terrimpi_wall_site site;
    uint32_t k;
    TERRIMPI_REFUSE(!sets || !sets->hider.tree, TERRIMP_E_NULL);
    tree = sets->hider.tree;
    TERRIMPI_TRY(terrimpi_walls_check(tree, walls));
    TERRIMPI_REFUSE(cell >= terrimpi_sets_level_nodes(tree, sets->cell_level) ||
                    (samples && !terrimpi_field_has(&tree->field, samples)), TERRIMP_E_RANGE);
    memset(&b, 0, sizeof b);
    node = terrimpi_tree_node(tree, tree->level_first[sets->cell_level] + cell);
    b.sets = sets;
    b.walls = site.walls = terrimpi_walls_of(tree, walls);
    b.cell = terrimpi_sets_place(tree, &node);
    b.base = tree->nodes[node.number].low;
    b.low = terrimpi_sets_low(sets);
    b.rounding = 4.0f * terrimpi_stand_rounding(tree);
    for (k = 0; k < 16u; k++) {
        uint32_t quads = tree->chunk_quads << node.level, part = (quads + 3u) / 4u + 1u;
        b.ground[k] = terrimpi_wall_sample(&site, node.x * quads + k % 4u * quads / 4u,
                                           node.z * quads + k / 4u * quads / 4u, part, part, 0);
    }
    terrimpi_sets_row(&b, &node, samples);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_sets_touch(const terrimp_sets *sets,
                                              const terrimp_rect *samples)
{
    const terrimp_quadtree *tree;
    terrimpi_sets_job b;
    uint32_t i;
    TERRIMPI_REFUSE(!sets || !samples || !sets->hider.tree, TERRIMP_E_NULL);
    tree = sets->hider.tree;
    TERRIMPI_REFUSE(!terrimpi_field_has(&tree->field, samples), TERRIMP_E_RANGE);
    memset(&b, 0, sizeof b);
    b.sets = sets;
    for (i = 0; i < terrimpi_sets_level_nodes(tree, sets->cell_level); i++) {
        terrimp_node cell = terrimpi_tree_node(tree, tree->level_first[sets->cell_level] + i);
        b.cell = terrimpi_sets_place(tree, &cell);
        terrimpi_sets_row(&b, &cell, samples);
    }
    return TERRIMP_OK;
}

/* ==== Layer builder ====================================================== >>impl-layer-builder */
/* Based on: Jeschke 2004, chapters 3 and 4. What is said without a source is derived here.

   Spacing. A line of sight meets the plane of depth 0 at x0 and a layer at depth t, in tangents of
   the picture, at slope + x0 / t. So between two layers it moves by |x0| times the step of 1 / t,
   which may be a texel at most: step = texel / largest |x0|. An eye h behind the cell's near side
   stands at most size / 2 + h cell_tan beside the axis and looks at a point at most view_tan t
   beside it, so |x0| <= (size / 2 + h q) t / (t + h), with q = cell_tan + view_tan. That is
   monotone in h: either the near side rules (h = 0), where steps of 1 / t are all alike, or the far
   side (h = cell_depth), where the step is affine in 1 / t.

   Parallax. A point at depth t that appears on a plane at depth p misses its place by an angle of
   at most |1/t - 1/p| r, with r = (|size| / 2 + h |q|) (end / (end + h))^2 at its largest: its
   offset at the plane over its distance from the eye, both bounded over the depths up to end. */

#define TERRIMPI_LAYERS_MAX 65535.0f

/* What a descriptor comes to. */
typedef struct terrimpi_layers_gaps {
    float start, end;    /* 1 / depth */
    float spare;         /* by which 1 / depth may be off */
    float texel;         /* or less, where half a texel in both directions is more than allowed */
    float side;          /* largest |x0| from the near side of the cell */
    float shrink, shift; /* of the step that the far side asks for */
    float change;        /* 1 / depth below which that is the smaller one */
} terrimpi_layers_gaps;

static float terrimpi_layers_hypot(float a, float b)
{
    float v[3];
    v[0] = a;
    v[1] = b;
    v[2] = 0.0f;
    return terrimpi_length(v);
}

/* The largest r of the bound of parallax. Over h it has one peak, at end - 2 size / q. */
static float terrimpi_layers_reach(const terrimp_layers_desc *d)
{
    float r = 0.5f * terrimpi_layers_hypot(d->cell_size[0], d->cell_size[1]);
    float q = terrimpi_layers_hypot(d->cell_tan[0] + d->view_tan[0],
                                    d->cell_tan[1] + d->view_tan[1]);
    float end = d->distance + d->depth, h, ratio;
    if (!terrimpi_finite(end))
        return r + d->cell_depth * q;
    h = terrimpi_min(terrimpi_max(0.0f, end - 2.0f * r / q), d->cell_depth);
    ratio = end / (end + h);
    return (r + h * q) * ratio * ratio;
}

static void terrimpi_layers_spacing(const terrimp_layers_desc *d, terrimpi_layers_gaps *s)
{
    float tolerance = d->tolerance_rad > 0.0f ? d->tolerance_rad : d->texel;
    float q[2], m = d->cell_depth, sum, reach = terrimpi_layers_reach(d);
    s->start = 1.0f / d->distance;
    s->end = 1.0f / (d->distance + d->depth);
    s->spare = reach > 0.0f ? tolerance / reach : s->start;
    s->texel = 0.9998f * terrimpi_min(d->texel, 1.414f * tolerance); /* rounding of depths */
    s->side = 0.5f * terrimpi_max(d->cell_size[0], d->cell_size[1]);
    q[0] = d->cell_tan[0] + d->view_tan[0];
    q[1] = d->cell_tan[1] + d->view_tan[1];
    s->shift = 0.0f;
    if (!terrimpi_finite(m)) {
        s->shrink = s->texel / terrimpi_max(q[0], q[1]);
        s->change = s->side > 0.0f ? terrimpi_max(q[0], q[1]) / s->side : TERRIMPI_INFINITY;
    } else {
        sum = terrimpi_max(0.5f * d->cell_size[0] + m * q[0], 0.5f * d->cell_size[1] + m * q[1]);
        s->shift = sum > 0.0f ? s->texel / sum : 0.0f;
        s->shrink = m * s->shift;
        s->change = !(sum > s->side) ? -1.0f
                    : s->side > 0.0f ? (sum / s->side - 1.0f) / m
                                     : TERRIMPI_INFINITY;
    }
    s->shrink = terrimpi_min(s->shrink, 1.0f);
}

static terrimp_result terrimpi_layers_check(const terrimp_layers_desc *d)
{
    int k;
    TERRIMPI_REFUSE(!terrimpi_finite(d->distance) || !terrimpi_finite(d->texel) ||
                    !terrimpi_finite(d->tolerance_rad) || d->depth != d->depth ||
                    d->cell_depth != d->cell_depth, TERRIMP_E_NOT_FINITE);
    for (k = 0; k < 2; k++) {
        float sum = d->cell_tan[k] + d->view_tan[k];
        TERRIMPI_REFUSE(!terrimpi_finite2(d->cell_size[k], sum), TERRIMP_E_NOT_FINITE);
        TERRIMPI_REFUSE(!(d->cell_size[k] >= 0.0f) || !(d->cell_tan[k] >= 0.0f) ||
                        !(d->view_tan[k] > 0.0f), TERRIMP_E_RANGE);
    }
    TERRIMPI_REFUSE(!(d->distance > 0.0f) || !terrimpi_finite(1.0f / d->distance) ||
                    !(d->depth >= 0.0f) || !(d->cell_depth >= 0.0f) || !(d->texel > 0.0f) ||
                    !(d->tolerance_rad >= 0.0f), TERRIMP_E_RANGE);
    return TERRIMP_OK;
}

/* How many steps of the far side take 1 / depth from d to the target or beyond. */
static uint32_t terrimpi_layers_steps(float d, float shrink, float shift, float target)
{
    uint32_t steps = 0, more;
    for (more = 1u << 16; more > 0; more /= 2u)
        if (terrimpi_layer_walk(d, shrink, shift, steps + more) > target)
            steps += more;
    return steps + 1u;
}

/* The number of layers, first those that the near side rules. */
static terrimp_result terrimpi_layers_count(const terrimpi_layers_gaps *s, terrimp_layers *l)
{
    float way = l->first - l->last, even = 0.0f, d;
    uint32_t steps;
    if (l->first > s->change) {
        float needed = way / l->step, until = (l->first - s->change) / l->step;
        if (needed <= until + 1.0f) {
            TERRIMPI_REFUSE(!(needed < TERRIMPI_LAYERS_MAX), TERRIMP_E_RANGE);
            l->even_count = terrimpi_ceil_u32(needed);
            l->count = l->even_count + 1u;
            l->step = way / (float)l->even_count;
            return TERRIMP_OK;
        }
        TERRIMPI_REFUSE(!(until < TERRIMPI_LAYERS_MAX), TERRIMP_E_RANGE);
        even = (float)((uint32_t)until + 1u);
    }
    d = even > 0.0f ? l->first - even * l->step : l->first;
    steps = terrimpi_layers_steps(d, l->shrink, l->shift, l->last);
    l->even_count = (uint32_t)even;
    l->count = l->even_count + steps + 1u;
    TERRIMPI_REFUSE((float)l->count > TERRIMPI_LAYERS_MAX, TERRIMP_E_RANGE);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_layers_plan(const terrimp_layers_desc *desc,
                                               terrimp_layers *layers)
{
    terrimpi_layers_gaps s;
    terrimp_layers l;
    TERRIMPI_REFUSE(!desc || !layers, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_layers_check(desc));
    terrimpi_layers_spacing(desc, &s);
    TERRIMPI_REFUSE(!(s.end + s.spare > 0.0f), TERRIMP_E_RANGE); /* no layer would be the last */
    if (desc->even) { /* the far side's smallest step for all */
        float least = s.shift + s.shrink * s.end;
        s.side = terrimpi_max(s.side, least > 0.0f ? s.texel / least : TERRIMPI_INFINITY);
        s.change = -1.0f;
    }
    l.start = desc->distance;
    l.end = desc->distance + desc->depth;
    l.texel = desc->texel;
    l.first = terrimpi_max(s.start - s.spare, 0.5f * (s.start + s.end));
    l.last = terrimpi_min(l.first, s.end + s.spare);
    l.step = s.side > 0.0f ? s.texel / s.side : 0.0f;
    l.shrink = s.shrink;
    l.shift = s.shift;
    l.count = 1;
    l.even_count = 0;
    if (l.first > l.last)
        TERRIMPI_TRY(terrimpi_layers_count(&s, &l));
    *layers = l;
    return TERRIMP_OK;
}

/* --- hidden texels --- */

/* The bits of the last word of a row that are texels. */
static uint32_t terrimpi_mask_tail(uint32_t width)
{
    return 0xffffffffu >> (31u - (width - 1u) % 32u);
}

/* The bits of a word of a row that are columns x to end - 1. */
static uint32_t terrimpi_mask_span(uint32_t word, uint32_t x, uint32_t end)
{
    return (word == x / 32u ? 0xffffffffu << x % 32u : 0xffffffffu) &
           (word == (end - 1u) / 32u ? terrimpi_mask_tail(end) : 0xffffffffu);
}

/* A word of a row's bits, without what lies outside of columns x to end - 1. */
static uint32_t terrimpi_mask_word(const uint32_t *row, uint32_t word, uint32_t x, uint32_t end)
{
    return word * 32u < end ? row[word] & terrimpi_mask_span(word, x, end) : 0u;
}

/* Adds opaque texels to a row of state, then keeps those whose neighbour at dx is there as well. */
static void terrimpi_mask_cull_row(const uint32_t *opaque, uint32_t width, int dx, uint32_t *row)
{
    uint32_t words = TERRIMP_MASK_WORDS(width), i, other = 0;
    row[words - 1u] &= terrimpi_mask_tail(width);
    if (dx < 0)
        for (i = 0; i < words; i++) {
            uint32_t all = row[i] | opaque[i];
            row[i] = all & (all << 1 | other);
            other = all >> 31;
        }
    else
        for (i = words; i-- > 0;) {
            uint32_t all = row[i] | (i + 1u < words ? opaque[i]
                                                    : opaque[i] & terrimpi_mask_tail(width));
            row[i] = all & (all >> 1 | other);
            other = all << 31;
        }
}

/* One step of a mask of state from a layer to the next: what has neighbours at dx, dy and across
   there hides what is behind it. */
static void terrimpi_mask_cull_step(const uint32_t *opaque, uint32_t width, uint32_t height, int dx,
                                    int dy, uint32_t *state)
{
    size_t words = TERRIMP_MASK_WORDS(width), y, i;
    for (y = 0; y < height; y++)
        terrimpi_mask_cull_row(opaque + y * words, width, dx, state + y * words);
    if (dy > 0) {
        for (i = 0; i < (height - 1u) * words; i++)
            state[i] &= state[i + words];
        memset(state + i, 0, words * sizeof *state);
        return;
    }
    for (i = height * words; i-- > words;)
        state[i] &= state[i - words];
    memset(state, 0, words * sizeof *state);
}

TERRIMP_API terrimp_result terrimp_layer_cull(const uint32_t *opaque, uint32_t width,
                                              uint32_t height, int rule, uint32_t *state,
                                              uint32_t *visible)
{
    size_t count = (size_t)height * TERRIMP_MASK_WORDS(width), i;
    int k;
    TERRIMPI_REFUSE(!opaque || !state || !visible, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!width || !height || rule < 0 || rule >= TERRIMP_CULL_COUNT, TERRIMP_E_RANGE);
    if (rule == TERRIMP_CULL_BLOCK) {
        for (i = 0; i < count; i++)
            visible[i] = opaque[i] & ~state[i];
        terrimpi_mask_cull_step(visible, width, height, 1, 1, state);
        terrimpi_mask_cull_step(state, width, height, -1, -1, state);
        return TERRIMP_OK;
    }
    for (i = 0; i < count; i++)
        visible[i] = opaque[i] & ~(state[i] & state[count + i] & state[2u * count + i] &
                                   state[3u * count + i]);
    for (k = 0; k < 4; k++) /* what was culled is in all four, and so is not missing in visible */
        terrimpi_mask_cull_step(visible, width, height, k & 1 ? 1 : -1, k & 2 ? 1 : -1,
                                state + (size_t)k * count);
    return TERRIMP_OK;
}

/* --- rectangles that hold all opaque texels --- */

/* A rectangle that might be taken whole or in two parts. */
typedef struct terrimpi_cover_node {
    terrimp_rect rect;
    uint32_t cost, parts; /* where its parts stand, behind it; 0: none */
    int kept;
} terrimpi_cover_node;

typedef struct terrimpi_cover {
    terrimp_cover_desc desc;
    terrimpi_cover_node *nodes;
    uint32_t node_count, node_limit;
    uint32_t *low, *high; /* of each column or row of a rectangle: its opaque texels' extent */
    float *beyond;        /* squared area of what lies at or beyond a cut there */
    uint32_t *swapped;    /* [width][words of height] the mask with x and y swapped */
} terrimpi_cover;

static uint32_t terrimpi_mask_bit_count(uint32_t bits)
{
    bits -= bits >> 1 & 0x55555555u;
    bits = (bits & 0x33333333u) + (bits >> 2 & 0x33333333u);
    return ((bits + (bits >> 4)) & 0x0f0f0f0fu) * 0x01010101u >> 24;
}

/* The number of the lowest bit that is set, and clears it. */
static uint32_t terrimpi_mask_next_bit(uint32_t *bits)
{
    uint32_t below = terrimpi_mask_bit_count((*bits & (0u - *bits)) - 1u);
    *bits &= *bits - 1u;
    return below;
}

/* Lays the mask down with x and y swapped. */
static void terrimpi_cover_swap(terrimpi_cover *c)
{
    uint32_t words = TERRIMP_MASK_WORDS(c->desc.width), x, y, i;
    uint32_t across = TERRIMP_MASK_WORDS(c->desc.height);
    memset(c->swapped, 0, (size_t)across * c->desc.width * sizeof *c->swapped);
    for (y = 0; y < c->desc.height; y++)
        for (i = 0; i < words; i++) {
            uint32_t bits = terrimpi_mask_word(c->desc.mask + (size_t)y * words, i, 0,
                                               c->desc.width);
            while (bits) {
                x = 32u * i + terrimpi_mask_next_bit(&bits);
                c->swapped[(size_t)x * across + y / 32u] |= 1u << y % 32u;
            }
        }
}

/* Extents of the opaque texels in each row of a rectangle, or each column; an empty one has
   low > high. Returns how many texels are opaque. */
static uint32_t terrimpi_cover_scan(terrimpi_cover *c, const terrimp_rect *rect, int columns)
{
    terrimp_rect r = columns ? terrimpi_rect(rect->y, rect->x, rect->height, rect->width) : *rect;
    uint32_t words = TERRIMP_MASK_WORDS(columns ? c->desc.height : c->desc.width);
    uint32_t end = r.x + r.width, y, word, opaque = 0;
    for (y = 0; y < r.height; y++) {
        const uint32_t *row = (columns ? c->swapped : c->desc.mask) + (size_t)(r.y + y) * words;
        c->low[y] = 1;
        c->high[y] = 0;
        for (word = r.x / 32u; word <= (end - 1u) / 32u; word++) {
            uint32_t bits = terrimpi_mask_word(row, word, r.x, end), last = bits;
            if (!bits)
                continue;
            opaque += terrimpi_mask_bit_count(bits);
            if (c->low[y] > c->high[y])
                c->low[y] = word * 32u + terrimpi_mask_next_bit(&bits) - r.x;
            last |= last >> 1, last |= last >> 2, last |= last >> 4, last |= last >> 8;
            last |= last >> 16;
            c->high[y] = word * 32u + terrimpi_mask_bit_count(last) - 1u - r.x;
        }
    }
    return opaque;
}

/* A growing extent of rows or columns. */
typedef struct terrimpi_cover_extent {
    uint32_t first, last, low, high;
} terrimpi_cover_extent;

static uint32_t terrimpi_cover_cost(const terrimpi_cover *c, uint32_t width, uint32_t height)
{
    return (width + 2u * c->desc.gutter) * (height + 2u * c->desc.gutter) + c->desc.quad_cost;
}

/* Adds column or row i; returns the squared area of the rectangle of all so far. */
static float terrimpi_cover_extent_add(const terrimpi_cover *c, terrimpi_cover_extent *e,
                                       uint32_t i)
{
    float area;
    if (c->low[i] <= c->high[i]) {
        if (e->first > e->last) {
            e->first = e->last = i;
            e->low = c->low[i];
            e->high = c->high[i];
        }
        e->first = terrimpi_min_u32(e->first, i);
        e->last = terrimpi_max_u32(e->last, i);
        e->low = terrimpi_min_u32(e->low, c->low[i]);
        e->high = terrimpi_max_u32(e->high, c->high[i]);
    }
    if (e->first > e->last)
        return 0.0f;
    area = (float)(e->last - e->first + 1u) * (float)(e->high - e->low + 1u);
    return area * area;
}

/* The cut between `count` columns or rows whose two parts have the least sum of squared areas, and
   that sum: so that it does not merely take a sliver off. */
static float terrimpi_cover_cut(terrimpi_cover *c, uint32_t count, uint32_t *at)
{
    terrimpi_cover_extent e = {1, 0, 0, 0};
    float best = TERRIMPI_FLOAT_MAX;
    uint32_t i;
    for (i = count; i-- > 0;)
        c->beyond[i] = terrimpi_cover_extent_add(c, &e, i);
    e.first = 1;
    e.last = 0;
    for (i = 1; i < count; i++) {
        float sum = terrimpi_cover_extent_add(c, &e, i - 1u) + c->beyond[i];
        if (sum < best) {
            best = sum;
            *at = i;
        }
    }
    return best;
}

/* Shrinks a rectangle to its opaque texels; returns how many there are. */
static uint32_t terrimpi_cover_tighten(terrimpi_cover *c, terrimp_rect *r)
{
    uint32_t opaque = terrimpi_cover_scan(c, r, 0), y;
    terrimpi_cover_extent e = {1, 0, 0, 0};
    for (y = 0; y < r->height; y++)
        terrimpi_cover_extent_add(c, &e, y);
    if (opaque)
        *r = terrimpi_rect(r->x + e.low, r->y + e.first, e.high - e.low + 1u,
                           e.last - e.first + 1u);
    return opaque;
}

/* Cuts a node in two, at the best place between any two of its columns or rows. */
static void terrimpi_cover_in_two(terrimpi_cover *c, uint32_t node)
{
    terrimp_rect r = c->nodes[node].rect, part[2];
    uint32_t x = 0, y = 0, k;
    float by_y = terrimpi_cover_cut(c, r.height, &y);
    terrimpi_cover_scan(c, &r, 1);
    part[0] = part[1] = r;
    if (terrimpi_cover_cut(c, r.width, &x) < by_y) {
        part[0].width = x;
        part[1].x += x;
        part[1].width -= x;
    } else {
        part[0].height = y;
        part[1].y += y;
        part[1].height -= y;
    }
    c->nodes[node].parts = c->node_count;
    for (k = 0; k < 2u; k++) {
        terrimpi_cover_tighten(c, &part[k]);
        c->nodes[c->node_count++].rect = part[k];
    }
}

/* Cuts a node up, if more is lost in it than another rectangle costs. */
static void terrimpi_cover_split(terrimpi_cover *c, uint32_t node)
{
    terrimpi_cover_node *n = &c->nodes[node];
    uint32_t opaque = terrimpi_cover_scan(c, &n->rect, 0);
    n->cost = terrimpi_cover_cost(c, n->rect.width, n->rect.height);
    n->parts = 0;
    if (n->rect.width * n->rect.height - opaque > c->desc.quad_cost &&
        c->node_count + 2u <= c->node_limit)
        terrimpi_cover_in_two(c, node);
}

/* What a rectangle saves by taking the place of all that lie within it; less than 0 when it reaches
   into others, which would then overlap. */
static float terrimpi_cover_gain(const terrimpi_cover *c, const terrimp_rect *r,
                                 const terrimp_rect *rects, uint32_t count)
{
    float gain = -(float)terrimpi_cover_cost(c, r->width, r->height);
    uint32_t i;
    for (i = 0; i < count; i++)
        if (terrimpi_atlas_contains(r, &rects[i]))
            gain += (float)terrimpi_cover_cost(c, rects[i].width, rects[i].height);
        else if (terrimpi_atlas_overlap(r, &rects[i]))
            return -1.0f;
    return gain;
}

static terrimp_rect terrimpi_cover_union(const terrimp_rect *a, const terrimp_rect *b)
{
    uint32_t x = terrimpi_min_u32(a->x, b->x), y = terrimpi_min_u32(a->y, b->y);
    return terrimpi_rect(x, y, terrimpi_max_u32(a->x + a->width, b->x + b->width) - x,
                         terrimpi_max_u32(a->y + a->height, b->y + b->height) - y);
}

/* Puts r in place of all that lie within it; returns how many rectangles are left. */
static uint32_t terrimpi_cover_swallow(const terrimp_rect *r, terrimp_rect *rects, uint32_t count)
{
    uint32_t i, kept = 0, placed = 0;
    for (i = 0; i < count; i++)
        if (!terrimpi_atlas_contains(r, &rects[i]))
            rects[kept++] = rects[i];
        else if (!placed++)
            rects[kept++] = *r;
    return kept;
}

/* Joins rectangles as long as one in their place costs less than they do. */
static uint32_t terrimpi_cover_join(const terrimpi_cover *c, terrimp_rect *rects, uint32_t count)
{
    uint32_t a, b, joined;
    do {
        joined = 0;
        for (a = 0; a < count; a++)
            for (b = a + 1u; b < count; b++) {
                terrimp_rect r = terrimpi_cover_union(&rects[a], &rects[b]);
                if (terrimpi_cover_cost(c, r.width, r.height) / 2u > /* far apart */
                        terrimpi_cover_cost(c, rects[a].width, rects[a].height) +
                            terrimpi_cover_cost(c, rects[b].width, rects[b].height) ||
                    terrimpi_cover_gain(c, &r, rects, count) <= 0.0f)
                    continue;
                count = terrimpi_cover_swallow(&r, rects, count);
                joined = 1;
                b = a;
            }
    } while (joined);
    return count;
}

/* Checks a descriptor and lays out the scratch memory; in base NULL only to count it. */
static terrimp_result terrimpi_cover_begin(const terrimp_cover_desc *desc, void *base,
                                           uint32_t capacity, terrimpi_cover *c, size_t *bytes)
{
    terrimpi_arena arena = terrimpi_arena_at(base);
    uint32_t longest = terrimpi_max_u32(desc->width, desc->height);
    c->desc = *desc;
    TERRIMPI_DEFAULT(c->desc.quad_cost, 20u);
    TERRIMPI_REFUSE(!terrimpi_within_u32(desc->width, 1, 16384) || desc->gutter > 64u ||
                    !terrimpi_within_u32(desc->height, 1, 16384) || !capacity ||
                    c->desc.quad_cost > 1u << 24, TERRIMP_E_RANGE);
    c->node_count = 0;
    c->node_limit = capacity < 0x10000000u ? 8u * capacity : 0x80000000u;
    c->low = (uint32_t *)terrimpi_take(&arena, longest, sizeof *c->low);
    c->high = (uint32_t *)terrimpi_take(&arena, longest, sizeof *c->high);
    c->beyond = (float *)terrimpi_take(&arena, longest, sizeof *c->beyond);
    c->swapped = (uint32_t *)terrimpi_take(
        &arena, (size_t)desc->width * TERRIMP_MASK_WORDS(desc->height), sizeof *c->swapped);
    c->nodes = (terrimpi_cover_node *)terrimpi_take(&arena, c->node_limit, sizeof *c->nodes);
    *bytes = arena.bytes;
    return arena.ok ? TERRIMP_OK : TERRIMP_E_OVERFLOW;
}

TERRIMP_API size_t terrimp_cover_scratch_bytes(const terrimp_cover_desc *desc, uint32_t capacity)
{
    terrimpi_cover c;
    size_t bytes;
    return desc && terrimpi_cover_begin(desc, NULL, capacity, &c, &bytes) == TERRIMP_OK ? bytes : 0;
}

/* Takes back the cuts that did not pay, and writes the rectangles that are left while there is
   room; returns how many they are. */
static uint32_t terrimpi_cover_prune(terrimpi_cover *c, terrimp_rect *rects, uint32_t capacity)
{
    uint32_t i, kept = 0;
    for (i = c->node_count; i-- > 0;) {
        terrimpi_cover_node *n = &c->nodes[i], *part = &c->nodes[n->parts];
        n->kept = i == 0;
        if (n->parts && part[0].cost + part[1].cost < n->cost)
            n->cost = part[0].cost + part[1].cost;
        else
            n->parts = 0;
    }
    for (i = 0; i < c->node_count; i++) {
        const terrimpi_cover_node *n = &c->nodes[i];
        if (n->kept && n->parts)
            c->nodes[n->parts].kept = c->nodes[n->parts + 1u].kept = 1;
        else if (n->kept && kept++ < capacity)
            rects[kept - 1u] = n->rect;
    }
    return kept;
}

TERRIMP_API terrimp_result terrimp_cover(const terrimp_cover_desc *desc, void *scratch,
                                         size_t bytes, terrimp_rect *rects, uint32_t capacity,
                                         uint32_t *count)
{
    terrimpi_cover c;
    size_t needed;
    uint32_t i, kept;
    TERRIMPI_REFUSE(!desc || !desc->mask || !rects || !count, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_cover_begin(desc, scratch, capacity, &c, &needed));
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes, needed));
    terrimpi_cover_swap(&c);
    c.nodes[0].rect = terrimpi_rect(0, 0, desc->width, desc->height);
    c.node_count = terrimpi_cover_tighten(&c, &c.nodes[0].rect) > 0;
    for (i = 0; i < c.node_count; i++)
        terrimpi_cover_split(&c, i);
    kept = terrimpi_cover_prune(&c, rects, capacity);
    TERRIMPI_REFUSE(kept > capacity, TERRIMP_E_CAPACITY);
    *count = terrimpi_cover_join(&c, rects, kept);
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_layer_pack(const uint32_t atlas[2], terrimp_layer_quad *quads,
                                              uint32_t count, uint32_t gutter,
                                              terrimp_rect *rects, uint32_t *order)
{
    uint32_t i;
    float scale;
    TERRIMPI_REFUSE(!atlas || !quads || !rects || !order, TERRIMP_E_NULL);
    for (i = 0; i < count; i++)
        TERRIMPI_REFUSE(!terrimpi_within_u32(quads[i].texels.width, 1, 65536) || gutter > 64u ||
                        !terrimpi_within_u32(quads[i].texels.height, 1, 65536), TERRIMP_E_RANGE);
    for (i = 0; i < count; i++) {
        rects[i] = quads[i].texels;
        rects[i].width += 2u * gutter;
        rects[i].height += 2u * gutter;
    }
    TERRIMPI_TRY(terrimp_pack_ffdh(atlas[0], atlas[1], rects, count, order, &scale));
    TERRIMPI_REFUSE(scale < 1.0f, TERRIMP_E_CAPACITY);
    for (i = 0; i < count; i++) {
        quads[i].x = rects[i].x + gutter;
        quads[i].y = rects[i].y + gutter;
    }
    return TERRIMP_OK;
}

/* --- recording without gaps --- */

/* Appends the point of edge a-b at a depth between those of its ends. */
static void terrimpi_layer_clip_cut(const float *vertices, uint32_t stride, const float depths[3],
                                    uint32_t a, uint32_t b, float depth, float *out)
{
    uint32_t low = depths[a] < depths[b] ? a : b, high = low == a ? b : a, i;
    float part = (depth - depths[low]) / (depths[high] - depths[low]);
    for (i = 0; i < stride; i++) {
        float from = vertices[(size_t)low * stride + i];
        out[i] = from + part * (vertices[(size_t)high * stride + i] - from);
    }
}

/* A polygon between two parallel planes has the vertices of the triangle that lie there, and those
   where its edges pass the planes: so no polygon is clipped twice. */
TERRIMP_API terrimp_result terrimp_layer_clip(const float *vertices, uint32_t stride,
                                              const float depths[3], float low, float high,
                                              float *out, uint32_t *count)
{
    uint32_t a, k, n = 0;
    TERRIMPI_REFUSE(!vertices || !depths || !out || !count, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(depths), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!stride || !(low <= high), TERRIMP_E_RANGE);
    for (a = 0; a < 3u; a++) {
        uint32_t b = a == 2u ? 0u : a + 1u;
        int rises = depths[b] > depths[a];
        if (depths[a] >= low && depths[a] <= high)
            memcpy(out + (size_t)n++ * stride, vertices + (size_t)a * stride, stride * sizeof *out);
        for (k = 0; k < 2u; k++) {
            float plane = (k == 0) == rises ? low : high;
            if ((depths[a] < plane && plane < depths[b]) ||
                (depths[b] < plane && plane < depths[a]))
                terrimpi_layer_clip_cut(vertices, stride, depths, a, b, plane,
                                        out + (size_t)n++ * stride);
        }
    }
    *count = n;
    return TERRIMP_OK;
}

static terrimp_result terrimpi_record_check(const terrimp_layer_record *r)
{
    TERRIMPI_REFUSE(!r || !r->layers || !r->picture || !r->masks, TERRIMP_E_NULL);
    return terrimpi_within_u32(r->width, 1, 16384) && terrimpi_within_u32(r->height, 1, 16384) &&
                   r->layers->count
               ? TERRIMP_OK : TERRIMP_E_RANGE;
}

static uint32_t *terrimpi_record_row(const terrimp_layer_record *r, uint32_t layer, uint32_t y)
{
    return r->masks + ((size_t)layer * r->height + y) * TERRIMP_MASK_WORDS(r->width);
}

/* Sets the texels of a row from column x to column end - 1. */
static void terrimpi_mask_fill(uint32_t *row, uint32_t x, uint32_t end)
{
    uint32_t word;
    for (word = x / 32u; x < end && word <= (end - 1u) / 32u; word++)
        row[word] |= terrimpi_mask_span(word, x, end);
}

/* The part of a convex polygon [count][2] between two heights, in columns; 0 when there is none. */
static int terrimpi_record_polygon_row(const float *uv, uint32_t count, float bottom, float top,
                                       float *left, float *right)
{
    uint32_t a, k;
    *left = TERRIMPI_FLOAT_MAX;
    *right = -TERRIMPI_FLOAT_MAX;
    for (a = 0; a < count; a++) {
        const float *p = uv + 2u * a, *q = uv + 2u * (a + 1u == count ? 0u : a + 1u);
        if (p[1] >= bottom && p[1] <= top) {
            *left = terrimpi_min(*left, p[0]);
            *right = terrimpi_max(*right, p[0]);
        }
        if (q[1] < p[1]) { /* an edge crosses a row at one place, from whichever side it is seen */
            const float *swap = p;
            p = q;
            q = swap;
        }
        for (k = 0; k < 2u; k++) {
            float y = k ? top : bottom, x;
            if (!(p[1] < y && y < q[1]))
                continue;
            x = p[0] + (q[0] - p[0]) * ((y - p[1]) / (q[1] - p[1]));
            *left = terrimpi_min(*left, x);
            *right = terrimpi_max(*right, x);
        }
    }
    return *left <= *right;
}

/* The least column or row from which texels count, for a coordinate; within 0..size. */
static uint32_t terrimpi_record_texel(float at, uint32_t size)
{
    return !(at > 0.0f) ? 0u : at >= (float)size ? size : (uint32_t)at;
}

/* Sets the texels that a convex polygon [count][2] touches, or those whose centres it holds. */
static void terrimpi_record_polygon(const terrimp_layer_record *r, uint32_t layer, const float *uv,
                                    uint32_t count)
{
    float low = TERRIMPI_FLOAT_MAX, high = -TERRIMPI_FLOAT_MAX, left, right;
    float centre = r->no_outline ? 0.5f : 0.0f;
    uint32_t i, y, end, touched = !r->no_outline;
    for (i = 0; i < count; i++) {
        low = terrimpi_min(low, uv[2u * i + 1u]);
        high = terrimpi_max(high, uv[2u * i + 1u]);
    }
    if (!count || high < 0.0f)
        return;
    end = terrimpi_min_u32(terrimpi_record_texel(high, r->height) + 1u, r->height);
    for (y = terrimpi_record_texel(low, r->height); y < end; y++) {
        if (terrimpi_record_polygon_row(uv, count, (float)y + centre, (float)(y + 1u) - centre,
                                        &left, &right) &&
            right >= 0.0f)
            terrimpi_mask_fill(terrimpi_record_row(r, layer, y),
                               terrimpi_record_texel(left + centre, r->width),
                               terrimpi_min_u32(terrimpi_record_texel(right + centre, r->width) +
                                                    touched, r->width));
    }
}

TERRIMP_API terrimp_result terrimp_layer_triangle(const terrimp_layer_record *record,
                                                  const float xyz[9])
{
    float seen[9], depths[3], polygon[15], uv[10], low, high;
    uint32_t layer, last, count, i;
    TERRIMPI_TRY(terrimpi_record_check(record));
    TERRIMPI_REFUSE(!xyz, TERRIMP_E_NULL);
    for (i = 0; i < 3u; i++) {
        const terrimp_capture *p = record->picture;
        float to[3];
        TERRIMPI_REFUSE(!terrimpi_finite3(xyz + 3u * i), TERRIMP_E_NOT_FINITE);
        terrimpi_sub(xyz + 3u * i, p->eye, to);
        depths[i] = seen[3u * i + 2u] = terrimpi_dot(to, p->forward);
        seen[3u * i] = terrimpi_dot(to, p->right) - p->tan_left * depths[i];
        seen[3u * i + 1u] = terrimpi_dot(to, p->up) - p->tan_down * depths[i];
    }
    low = terrimpi_min(depths[0], terrimpi_min(depths[1], depths[2]));
    high = terrimpi_max(depths[0], terrimpi_max(depths[1], depths[2]));
    if (!(high >= record->layers->start) || !(low <= record->layers->end))
        return TERRIMP_OK;
    layer = terrimp_layer_of(record->layers, low);
    if (layer && low <= terrimp_layer_border(record->layers, layer))
        layer--; /* what touches a border is in both */
    last = terrimp_layer_of(record->layers, high);
    for (; layer <= last; layer++) {
        low = terrimp_layer_border(record->layers, layer);
        high = terrimp_layer_border(record->layers, layer + 1u);
        TERRIMPI_TRY(terrimp_layer_clip(seen, 3, depths, low, high, polygon, &count));
        for (i = 0; i < count; i++) {
            float texel = record->layers->texel * polygon[3u * i + 2u];
            uv[2u * i] = polygon[3u * i] / texel;
            uv[2u * i + 1u] = polygon[3u * i + 1u] / texel;
        }
        terrimpi_record_polygon(record, layer, uv, count);
    }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_layer_depths(const terrimp_layer_record *record,
                                                const float *depths)
{
    uint32_t x, y, k, layer, last;
    TERRIMPI_TRY(terrimpi_record_check(record));
    TERRIMPI_REFUSE(!depths, TERRIMP_E_NULL);
    for (y = 0; y < record->height; y++)
        for (x = 0; x < record->width; x++) {
            float low = TERRIMPI_FLOAT_MAX, high = 0.0f;
            for (k = 0; k < 4u; k++) {
                float d = depths[(size_t)(y + (k >> 1)) * (record->width + 1u) + x + (k & 1u)];
                if (!(d > 0.0f) || !terrimpi_finite(d))
                    continue;
                low = terrimpi_min(low, d);
                high = terrimpi_max(high, d);
            }
            if (!(high >= record->layers->start) || !(low <= record->layers->end))
                continue;
            layer = terrimp_layer_of(record->layers, low);
            last = terrimp_layer_of(record->layers, high);
            for (; layer <= last; layer++)
                terrimpi_record_row(record, layer, y)[x / 32u] |= 1u << x % 32u;
        }
    return TERRIMP_OK;
}

/* A word of a row's bits, with dx = 1 each moved to the place of its neighbour before it. */
static uint32_t terrimpi_mask_at(const uint32_t *row, uint32_t width, uint32_t word, uint32_t dx)
{
    uint32_t here = terrimpi_mask_word(row, word, 0, width);
    return dx ? here >> 1 | terrimpi_mask_word(row, word + 1u, 0, width) << 31 : here;
}

TERRIMP_API terrimp_result terrimp_layer_repair(const uint32_t *front, const uint32_t *back,
                                                uint32_t width, uint32_t height,
                                                uint32_t *wanted)
{
    size_t words = TERRIMP_MASK_WORDS(width), y;
    uint32_t word, k;
    TERRIMPI_REFUSE(!front || !back || !wanted, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!width || !height, TERRIMP_E_RANGE);
    memset(wanted, 0, height * words * sizeof *wanted);
    for (y = 0; y + 1u < height; y++)
        for (word = 0; word < words; word++) {
            uint32_t f[4], both[4], one[4], missing[4]; /* of the block's corner at dx + 2 dy */
            for (k = 0; k < 4u; k++) {
                size_t row = (y + (k >> 1)) * words;
                uint32_t b = terrimpi_mask_at(back + row, width, word, k & 1u);
                f[k] = terrimpi_mask_at(front + row, width, word, k & 1u);
                both[k] = f[k] & b;
                one[k] = f[k] ^ b;
                missing[k] = f[k] & ~b;
            }
            for (k = 0; k < 4u; k++) {
                uint32_t want = both[k ^ 1u] & both[k ^ 2u] & one[k] & one[k ^ 3u] & missing[k];
                uint32_t *to = wanted + (y + (k >> 1)) * words + word;
                to[0] |= k & 1u ? want << 1 : want;
                if ((k & 1u) && want >> 31)
                    to[1] |= 1u; /* inside: the bit beyond the last column is never set */
            }
        }
    return TERRIMP_OK;
}

/* --- textured depth meshes --- */

#define TERRIMPI_DEPTH_STAR 48u /* triangles round a vertex at most, or it stays */
#define TERRIMPI_DEPTH_END 0xffffffffu

/* A run of opaque texels of one column and row through neighbouring layers: where a surface passes
   it is one cell of its mesh. Its corners are numbered x + 2 y. */
typedef struct terrimpi_depth_cell {
    uint16_t x, y, k0, k1;
    uint32_t sheet;
} terrimpi_depth_cell;

/* A corner that cells share. */
typedef struct terrimpi_depth_corner {
    float at[3]; /* column, row, layer */
    uint16_t low, high; /* layers that all of its cells have */
    uint8_t fixed;      /* which of these it takes is settled */
} terrimpi_depth_corner;

typedef struct terrimpi_depth_triangle {
    uint32_t corner[3]; /* the first one is TERRIMPI_DEPTH_END once it is gone */
    uint32_t next[3];   /* corners of other triangles at the same vertex: 3 * triangle + number */
    uint32_t sheet;
    uint32_t points;    /* the opaque texels that it stands for, as a list */
} terrimpi_depth_triangle;

/* A texel of a layer that can be seen, by its middle. */
typedef struct terrimpi_depth_point {
    uint16_t x, y, k;
    uint16_t fan; /* which triangle of a fan would stand for it */
    uint32_t next;
} terrimpi_depth_point;

typedef struct terrimpi_depth {
    const terrimp_depth_mesh_desc *desc;
    float tolerance;
    terrimpi_depth_cell *cells;        /* sorted by row, column, layer */
    uint32_t *first_cell;              /* [height * width + 1] */
    uint32_t *beside;                  /* [4 * cells] the cells that they go on in, side by side */
    uint32_t *joined;                  /* [4 * cells] corners that are one, as trees */
    uint32_t *vertex_of;               /* [4 * cells] and where they stand in: */
    terrimpi_depth_corner *corners;    /* [4 * cells + 4 * cells] */
    terrimpi_depth_triangle *triangles; /* [4 * cells] */
    terrimpi_depth_point *points;      /* [points] */
    uint32_t *at;                      /* [8 * cells] first triangle corner of each vertex; before
                                          that a slot for each texel */
    uint8_t *stale;                    /* [8 * cells] nothing has changed round it */
    uint32_t *queue;                   /* [8 * cells] */
    uint32_t cell_count, corner_count, triangle_count, point_count, sheet_count;
} terrimpi_depth;

static int terrimpi_depth_set(const terrimp_depth_mesh_desc *d, const uint32_t *masks, uint32_t x,
                              uint32_t y, uint32_t k)
{
    return (int)(masks[((size_t)k * d->height + y) * TERRIMP_MASK_WORDS(d->width) + x / 32u] >>
                     x % 32u & 1u);
}

/* Finds the next run of opaque texels from layer k on, and how many of them can be seen; 0 when
   there are no more. Where some between are hidden it ends in their middle: there two surfaces pass
   that only seem to be one. */
static int terrimpi_depth_run(const terrimp_depth_mesh_desc *s, uint32_t x, uint32_t y, uint32_t k,
                              terrimpi_depth_cell *run, uint32_t *seen)
{
    uint32_t hidden = 0;
    while (k < s->layers && !terrimpi_depth_set(s, s->opaque, x, y, k))
        k++;
    run->x = (uint16_t)x;
    run->y = (uint16_t)y;
    run->k0 = (uint16_t)k;
    run->sheet = TERRIMPI_DEPTH_END;
    if (k >= s->layers)
        return 0;
    for (*seen = 0; k < s->layers && terrimpi_depth_set(s, s->opaque, x, y, k); k++) {
        int shows = terrimpi_depth_set(s, s->visible, x, y, k);
        if (shows && *seen && hidden > 0) {
            run->k1 = (uint16_t)(k - 1u - hidden / 2u);
            break;
        }
        hidden = shows ? 0u : hidden + 1u;
        *seen += (uint32_t)shows;
        run->k1 = (uint16_t)k;
    }
    return 1;
}

/* Finds the cells, runs of which something can be seen, or only counts them and their texels. */
static void terrimpi_depth_cells(terrimpi_depth *d, int fill)
{
    const terrimp_depth_mesh_desc *s = d->desc;
    uint32_t x, y, k, seen;
    d->cell_count = d->point_count = 0;
    for (y = 0; y < s->height; y++)
        for (x = 0; x < s->width; x++) {
            terrimpi_depth_cell run;
            run.k1 = 0;
            if (fill)
                d->first_cell[y * s->width + x] = d->cell_count;
            for (k = 0; terrimpi_depth_run(s, x, y, k, &run, &seen); k = run.k1 + 1u) {
                if (seen && fill)
                    d->cells[d->cell_count] = run;
                d->cell_count += seen > 0;
                d->point_count += seen;
            }
        }
    if (fill)
        d->first_cell[s->height * s->width] = d->cell_count;
}

static uint32_t terrimpi_depth_root(uint32_t *joined, uint32_t i)
{
    while (joined[i] != i)
        i = joined[i] = joined[joined[i]];
    return i;
}

static void terrimpi_depth_join(uint32_t *joined, uint32_t a, uint32_t b)
{
    a = terrimpi_depth_root(joined, a);
    b = terrimpi_depth_root(joined, b);
    joined[a > b ? a : b] = a > b ? b : a;
}

static int terrimpi_depth_touch(const terrimpi_depth_cell *a, const terrimpi_depth_cell *b)
{
    return a->k0 <= b->k1 + 1u && b->k0 <= a->k1 + 1u;
}

/* The texel beside one: sides are +x, +y, -x, -y. TERRIMPI_DEPTH_END: the picture ends there. */
static uint32_t terrimpi_depth_texel(const terrimpi_depth *d, uint32_t x, uint32_t y, uint32_t side)
{
    uint32_t width = d->desc->width, texel = y * width + x;
    switch (side) {
    case 0: return x + 1u < width ? texel + 1u : TERRIMPI_DEPTH_END;
    case 1: return y + 1u < d->desc->height ? texel + width : TERRIMPI_DEPTH_END;
    case 2: return x > 0 ? texel - 1u : TERRIMPI_DEPTH_END;
    default: return y > 0 ? texel - width : TERRIMPI_DEPTH_END;
    }
}

/* Finds the cells that go on in each other, texel by texel: of those that touch, the closest with
   the closest. */
static void terrimpi_depth_match(terrimpi_depth *d)
{
    uint32_t i, n, end, last, side, first;
    memset(d->beside, 0xff, 4u * d->cell_count * sizeof *d->beside);
    for (first = 0; first < d->cell_count; first = last) {
        const terrimpi_depth_cell *c = &d->cells[first];
        last = d->first_cell[c->y * d->desc->width + c->x + 1u];
        for (side = 0; side < 2u; side++) {
            uint32_t texel = terrimpi_depth_texel(d, c->x, c->y, side);
            if (texel == TERRIMPI_DEPTH_END)
                continue;
            end = d->first_cell[texel + 1u];
            for (i = first, n = d->first_cell[texel]; i < last && n < end;) {
                if (terrimpi_depth_touch(&d->cells[i], &d->cells[n])) {
                    d->beside[4u * i + side] = n;
                    d->beside[4u * n++ + side + 2u] = i++;
                } else if (d->cells[i].k1 < d->cells[n].k1)
                    i++;
                else
                    n++;
            }
        }
    }
}

/* The corner at one end of a side of a cell: the same one as at that end of the opposite side of
   the cell beside it. */
static uint32_t terrimpi_depth_end(uint32_t cell, uint32_t side, uint32_t end)
{
    return 4u * cell + (side % 2u ? end : 2u * end) + (side < 2u ? 1u << side : 0u);
}

/* Makes one vertex of all corners that connected cells share, with the layers common to them. */
static void terrimpi_depth_connect(terrimpi_depth *d)
{
    uint32_t i, k;
    for (i = 0; i < 4u * d->cell_count; i++)
        d->joined[i] = i;
    for (i = 0; i < d->cell_count; i++)
        for (k = 0; k < 4u; k++) {
            uint32_t side = k / 2u, beside = d->beside[4u * i + side];
            if (beside != TERRIMPI_DEPTH_END)
                terrimpi_depth_join(d->joined, terrimpi_depth_end(i, side, k % 2u),
                                    terrimpi_depth_end(beside, side + 2u, k % 2u));
        }
    d->corner_count = 0;
    for (i = 0; i < 4u * d->cell_count; i++) {
        const terrimpi_depth_cell *c = &d->cells[i / 4u];
        uint32_t root = terrimpi_depth_root(d->joined, i);
        terrimpi_depth_corner *v;
        d->vertex_of[i] = root == i ? d->corner_count++ : d->vertex_of[root];
        v = &d->corners[d->vertex_of[i]];
        if (root == i) {
            v->at[0] = (float)(c->x + (i & 1u));
            v->at[1] = (float)(c->y + (i >> 1 & 1u));
            v->low = c->k0;
            v->high = c->k1;
        }
        v->low = v->low > c->k0 ? v->low : c->k0;
        v->high = v->high < c->k1 ? v->high : c->k1;
        v->fixed = 0;
    }
    for (i = 0; i < d->corner_count; i++) {
        d->corners[i].at[2] = 0.5f * ((float)d->corners[i].low + (float)d->corners[i].high);
        d->corners[i].fixed = d->corners[i].high <= d->corners[i].low + 1u;
    }
}

static void terrimpi_depth_fix(terrimpi_depth_corner *v, int high)
{
    if (v->fixed)
        return;
    v->at[2] = (float)(high ? v->high : v->low);
    v->fixed = 1;
}

/* A surface that is seen edge-on is one long cell in each texel. Its corners take the ends of that,
   which is left to choose where other cells do not say. */
static void terrimpi_depth_stretch(terrimpi_depth *d, uint32_t cell)
{
    const terrimpi_depth_cell *c = &d->cells[cell];
    int low = 0, high = 0, upright = d->beside[4u * cell + 1u] != TERRIMPI_DEPTH_END;
    uint32_t i;
    for (i = 0; i < 4u; i++) {
        const terrimpi_depth_corner *v = &d->corners[d->vertex_of[4u * cell + i]];
        low |= v->fixed && v->at[2] < (float)c->k0 + 1.0f;
        high |= v->fixed && v->at[2] > (float)c->k1 - 1.0f;
    }
    for (i = 0; i < 4u && !(low && high); i++)
        terrimpi_depth_fix(&d->corners[d->vertex_of[4u * cell + i]],
                           low || (!high && (upright ? i & 1u : i >> 1)));
}

/* Where a fold begins one cell touches two in the texel beside it, but goes on in the closer one
   only: the side of the other one reaches up to it, or eyes could see between them. */
static void terrimpi_depth_reach(terrimpi_depth *d, uint32_t cell)
{
    const terrimpi_depth_cell *c = &d->cells[cell];
    uint32_t side, other, k;
    for (side = 0; side < 4u; side++) {
        uint32_t texel = terrimpi_depth_texel(d, c->x, c->y, side);
        if (texel == TERRIMPI_DEPTH_END || d->beside[4u * cell + side] != TERRIMPI_DEPTH_END)
            continue;
        for (other = d->first_cell[texel]; other < d->first_cell[texel + 1u]; other++)
            for (k = 0; k < 2u && terrimpi_depth_touch(c, &d->cells[other]); k++) {
                uint32_t from = d->vertex_of[terrimpi_depth_end(cell, side, k)];
                uint32_t to = d->vertex_of[terrimpi_depth_end(other, (side + 2u) % 4u, k)];
                d->corners[from].at[2] = d->corners[to].at[2];
            }
    }
}

static uint32_t terrimpi_depth_triangle_add(terrimpi_depth *d, uint32_t a, uint32_t b, uint32_t c,
                                            uint32_t sheet)
{
    terrimpi_depth_triangle *t = &d->triangles[d->triangle_count];
    uint32_t k;
    t->corner[0] = a;
    t->corner[1] = b;
    t->corner[2] = c;
    t->sheet = sheet;
    t->points = TERRIMPI_DEPTH_END;
    for (k = 0; k < 3u; k++) {
        t->next[k] = d->at[t->corner[k]];
        d->at[t->corner[k]] = 3u * d->triangle_count + k;
    }
    return d->triangle_count++;
}

/* A cell of which no triangle would come near one end gets two more, along the line of sight; if
   the cell to the left or below has the same layers and such a pair, that is made longer. */
static void terrimpi_depth_spine(terrimpi_depth *d, uint32_t cell)
{
    const terrimpi_depth_cell *c = &d->cells[cell];
    uint32_t *spines = d->joined, first = d->corner_count, level, k; /* [cells] first triangle */
    for (k = 0; k < 2u; k++) {
        uint32_t o = d->beside[4u * cell + k + 2u], *v;
        if (o >= cell || spines[o] == TERRIMPI_DEPTH_END || d->cells[o].k0 != c->k0 ||
            d->cells[o].k1 != c->k1 || d->cells[o].sheet != c->sheet)
            continue;
        v = d->triangles[spines[o] + 1u].corner; /* 2, 1, 3 */
        if (d->corners[v[0]].at[k] < d->corners[v[2]].at[k]) {
            d->corners[v[1]].at[k] += 1.0f;
            d->corners[v[2]].at[k] += 1.0f;
            spines[cell] = spines[o];
            return;
        }
    }
    k = d->beside[4u * cell + 1u];
    level = k == TERRIMPI_DEPTH_END || d->cells[k].k0 != c->k0 || d->cells[k].k1 != c->k1;
    for (k = 0; k < 4u; k++) {
        terrimpi_depth_corner *v = &d->corners[d->corner_count];
        v->at[0] = (float)c->x + 0.5f;
        v->at[1] = (float)c->y + 0.5f;
        v->at[1u - level] += k & 1u ? 0.5f : -0.5f;
        v->at[2] = k & 2u ? (float)c->k1 + 0.5f : terrimpi_max(0.0f, (float)c->k0 - 0.5f);
        d->at[d->corner_count++] = TERRIMPI_DEPTH_END;
    }
    spines[cell] = terrimpi_depth_triangle_add(d, first, first + 1u, first + 2u, c->sheet);
    terrimpi_depth_triangle_add(d, first + 2u, first + 1u, first + 3u, c->sheet);
}

/* Squared distance from a point to a segment. */
static float terrimpi_depth_to_edge(const float p[3], const float a[3], const float b[3])
{
    float ab[3], ap[3], square, part;
    int k;
    terrimpi_sub(b, a, ab);
    terrimpi_sub(p, a, ap);
    square = terrimpi_dot(ab, ab);
    part = square > 0.0f ? terrimpi_dot(ap, ab) / square : 0.0f;
    part = terrimpi_min(terrimpi_max(part, 0.0f), 1.0f);
    for (k = 0; k < 3; k++)
        ap[k] -= part * ab[k];
    return terrimpi_dot(ap, ap);
}

/* Squared distance from a point to a triangle. */
static float terrimpi_depth_to_triangle(const float p[3], const float a[3], const float b[3],
                                        const float c[3])
{
    float ab[3], ac[3], ap[3], aa, bb, mix, s, t, scale, best;
    int k;
    terrimpi_sub(b, a, ab);
    terrimpi_sub(c, a, ac);
    terrimpi_sub(p, a, ap);
    aa = terrimpi_dot(ab, ab);
    bb = terrimpi_dot(ac, ac);
    mix = terrimpi_dot(ab, ac);
    s = bb * terrimpi_dot(ap, ab) - mix * terrimpi_dot(ap, ac);
    t = aa * terrimpi_dot(ap, ac) - mix * terrimpi_dot(ap, ab);
    scale = aa * bb - mix * mix;
    if (s >= 0.0f && t >= 0.0f && s + t <= scale && scale > 0.0f) {
        for (k = 0; k < 3; k++)
            ap[k] -= (s * ab[k] + t * ac[k]) / scale;
        return terrimpi_dot(ap, ap);
    }
    best = terrimpi_min(terrimpi_depth_to_edge(p, a, b), terrimpi_depth_to_edge(p, b, c));
    return terrimpi_min(best, terrimpi_depth_to_edge(p, c, a));
}

static const float *terrimpi_depth_at(const terrimpi_depth *d, uint32_t vertex)
{
    return d->corners[vertex].at;
}

/* Squared distance from an opaque texel's middle to a triangle of three vertices. */
static float terrimpi_depth_gap(const terrimpi_depth *d, const terrimpi_depth_point *p,
                                const uint32_t v[3])
{
    float at[3];
    at[0] = (float)p->x + 0.5f;
    at[1] = (float)p->y + 0.5f;
    at[2] = (float)p->k;
    return terrimpi_depth_to_triangle(at, terrimpi_depth_at(d, v[0]), terrimpi_depth_at(d, v[1]),
                                      terrimpi_depth_at(d, v[2]));
}

static void terrimpi_depth_give(terrimpi_depth *d, uint32_t point, uint32_t triangle)
{
    d->points[point].next = d->triangles[triangle].points;
    d->triangles[triangle].points = point;
}

/* The closer of a pair of triangles to an opaque texel's middle, if it is closer than the one that
   is known. */
static void terrimpi_depth_closer(const terrimpi_depth *d, const terrimpi_depth_point *p,
                                  uint32_t pair, uint32_t *best, float *least)
{
    uint32_t t;
    for (t = pair; t < pair + 2u; t++) {
        float gap = terrimpi_depth_gap(d, p, d->triangles[t].corner);
        if (gap < *least) {
            *least = gap;
            *best = t;
        }
    }
}

/* Finds a triangle for an opaque texel: of its own cell, else of those in the texels beside it,
   else of a spine. */
static void terrimpi_depth_attach(terrimpi_depth *d, uint32_t cell, uint32_t point, int give)
{
    const terrimpi_depth_cell *c = &d->cells[cell];
    const terrimpi_depth_point *p = &d->points[point];
    float limit = d->tolerance * d->tolerance, least = TERRIMPI_FLOAT_MAX;
    uint32_t best = 0, side, i;
    terrimpi_depth_closer(d, p, 2u * cell, &best, &least);
    for (side = 0; side < 4u && least > limit; side++) {
        uint32_t texel = terrimpi_depth_texel(d, c->x, c->y, side);
        for (i = texel == TERRIMPI_DEPTH_END ? 0u : d->first_cell[texel];
             texel != TERRIMPI_DEPTH_END && i < d->first_cell[texel + 1u]; i++)
            terrimpi_depth_closer(d, p, 2u * i, &best, &least);
    }
    if (least > limit && d->joined[cell] == TERRIMPI_DEPTH_END)
        terrimpi_depth_spine(d, cell);
    if (least > limit)
        terrimpi_depth_closer(d, p, d->joined[cell], &best, &least);
    if (give)
        terrimpi_depth_give(d, point, best);
}

/* Two triangles for each cell, and the opaque texels that they stand for. */
static void terrimpi_depth_first_mesh(terrimpi_depth *d)
{
    uint32_t i, k, point;
    int give;
    for (i = 0; i < d->cell_count; i++)
        terrimpi_depth_stretch(d, i);
    for (i = 0; i < d->cell_count; i++)
        terrimpi_depth_reach(d, i);
    memset(d->at, 0xff, d->corner_count * sizeof *d->at);
    memset(d->joined, 0xff, d->cell_count * sizeof *d->joined); /* from here on: its spine */
    d->triangle_count = 0;
    for (i = 0; i < d->cell_count; i++) {
        const uint32_t *v = d->vertex_of + 4u * i;
        terrimpi_depth_triangle_add(d, v[0], v[1], v[2], d->cells[i].sheet);
        terrimpi_depth_triangle_add(d, v[3], v[2], v[1], d->cells[i].sheet);
    }
    for (give = 0; give < 2; give++) /* when all spines are as long as they come to be */
        for (i = 0, point = 0; i < d->cell_count; i++)
            for (k = d->cells[i].k0; k <= d->cells[i].k1; k++) {
                terrimpi_depth_point *p = &d->points[point];
                p->x = d->cells[i].x;
                p->y = d->cells[i].y;
                p->k = (uint16_t)k;
                if (terrimpi_depth_set(d->desc, d->desc->visible, p->x, p->y, k))
                    terrimpi_depth_attach(d, i, point++, give);
            }
}

/* Deals the cells out to sheets: each is what can be reached from its first cell over shared edges
   without coming to a texel twice. */
static void terrimpi_depth_sheets(terrimpi_depth *d)
{
    uint32_t i, k, n, end, width = d->desc->width, *slot = d->at;
    d->sheet_count = 0;
    for (i = 0; i < d->desc->height * width; i++)
        slot[i] = TERRIMPI_DEPTH_END;
    for (i = 0; i < d->cell_count; i++) {
        if (d->cells[i].sheet != TERRIMPI_DEPTH_END)
            continue;
        d->cells[i].sheet = d->sheet_count;
        slot[d->cells[i].y * width + d->cells[i].x] = d->sheet_count;
        d->queue[0] = i;
        for (n = 0, end = 1; n < end; n++)
            for (k = 0; k < 4u; k++) {
                uint32_t o = d->beside[4u * d->queue[n] + k], *at;
                if (o == TERRIMPI_DEPTH_END || d->cells[o].sheet != TERRIMPI_DEPTH_END)
                    continue;
                at = &slot[d->cells[o].y * width + d->cells[o].x];
                if (*at == d->sheet_count)
                    continue;
                *at = d->cells[o].sheet = d->sheet_count;
                d->queue[end++] = o;
            }
        d->sheet_count++;
    }
}

/* What stands round a vertex. */
typedef struct terrimpi_depth_star {
    uint32_t triangles[TERRIMPI_DEPTH_STAR], others[2u * TERRIMPI_DEPTH_STAR];
    uint32_t count, other_count;
    uint8_t shared[2u * TERRIMPI_DEPTH_STAR]; /* triangles at the edge to each other vertex */
    uint8_t open[2u * TERRIMPI_DEPTH_STAR];   /* that edge is border or seam */
    uint32_t open_count;
} terrimpi_depth_star;

/* Collects the living triangles at a vertex, and forgets the others; 0 when they are too many. */
static int terrimpi_depth_collect(terrimpi_depth *d, uint32_t vertex, terrimpi_depth_star *s)
{
    uint32_t *at = &d->at[vertex], i, k, n, sheet[2u * TERRIMPI_DEPTH_STAR];
    s->count = s->other_count = s->open_count = 0;
    while (*at != TERRIMPI_DEPTH_END) {
        const terrimpi_depth_triangle *t = &d->triangles[*at / 3u];
        if (t->corner[0] == TERRIMPI_DEPTH_END) {
            *at = t->next[*at % 3u];
            continue;
        }
        if (s->count == TERRIMPI_DEPTH_STAR)
            return 0;
        s->triangles[s->count++] = *at / 3u;
        at = &d->triangles[*at / 3u].next[*at % 3u];
    }
    for (i = 0; i < s->count; i++)
        for (k = 0; k < 3u; k++) {
            const terrimpi_depth_triangle *t = &d->triangles[s->triangles[i]];
            if (t->corner[k] == vertex)
                continue;
            for (n = 0; n < s->other_count && s->others[n] != t->corner[k]; n++) {}
            if (n == s->other_count) {
                s->others[s->other_count++] = t->corner[k];
                s->shared[n] = 0;
                s->open[n] = 0;
                sheet[n] = t->sheet;
            }
            s->shared[n]++;
            s->open[n] |= sheet[n] != t->sheet;
        }
    for (n = 0; n < s->other_count; n++) {
        s->open[n] |= s->shared[n] != 2u;
        s->open_count += s->open[n];
    }
    return 1;
}

/* Whether an opaque texel's middle lies within the tolerance of a point, in each direction. */
static int terrimpi_depth_near_texel(const terrimpi_depth *d, const float p[3])
{
    const terrimp_depth_mesh_desc *s = d->desc;
    float r = d->tolerance;
    uint32_t size[3], low[3], high[3], i, x, y, k;
    size[0] = s->width;
    size[1] = s->height;
    size[2] = s->layers;
    for (i = 0; i < 3u; i++) { /* those at low..high - 1 */
        float middle = i < 2u ? p[i] - 0.5f : p[i];
        low[i] = !(middle - r > 0.0f) ? 0u : terrimpi_ceil_u32(middle - r);
        high[i] = middle + r < 0.0f ? 0u : terrimpi_min_u32((uint32_t)(middle + r) + 1u, size[i]);
    }
    for (k = low[2]; k < high[2]; k++)
        for (y = low[1]; y < high[1]; y++)
            for (x = low[0]; x < high[0]; x++)
                if (terrimpi_depth_set(s, s->opaque, x, y, k))
                    return 1;
    return 0;
}

static float terrimpi_depth_length(const terrimpi_depth *d, uint32_t a, uint32_t b)
{
    float between[3];
    terrimpi_sub(terrimpi_depth_at(d, b), terrimpi_depth_at(d, a), between);
    return terrimpi_length(between);
}

/* Whether a triangle lies near opaque texels everywhere: looked at in steps of up to one unit. */
static int terrimpi_depth_on_texels(const terrimpi_depth *d, const uint32_t v[3])
{
    const float *a = terrimpi_depth_at(d, v[0]), *b = terrimpi_depth_at(d, v[1]);
    const float *c = terrimpi_depth_at(d, v[2]);
    uint32_t rows = 1u + (uint32_t)terrimpi_depth_length(d, v[0], v[2]), i, n, k;
    float across = terrimpi_depth_length(d, v[0], v[1]);
    for (n = 0; n <= rows; n++) {
        float t = (float)n / (float)rows;
        uint32_t steps = 1u + (uint32_t)((1.0f - t) * across);
        for (i = 0; i <= steps; i++) {
            float s = (1.0f - t) * (float)i / (float)steps, p[3];
            for (k = 0; k < 3u; k++)
                p[k] = a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]);
            if (!terrimpi_depth_near_texel(d, p))
                return 0;
        }
    }
    return 1;
}

/* Twice the area of a triangle in the picture; > 0 as long as it shows its front. */
static float terrimpi_depth_area(const terrimpi_depth *d, const uint32_t v[3])
{
    const float *a = terrimpi_depth_at(d, v[0]), *b = terrimpi_depth_at(d, v[1]);
    const float *c = terrimpi_depth_at(d, v[2]);
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/* The triangles that take the place of a star when its middle moves to another vertex. */
typedef struct terrimpi_depth_fan {
    uint32_t triangles[2u * TERRIMPI_DEPTH_STAR], corner[TERRIMPI_DEPTH_STAR][3];
    uint32_t count, all; /* after them those that stand round that vertex already */
} terrimpi_depth_fan;

static int terrimpi_depth_fan_of(const terrimpi_depth *d, const terrimpi_depth_star *s,
                                 uint32_t from, uint32_t to, terrimpi_depth_fan *f)
{
    uint32_t i, k;
    f->count = 0;
    for (i = 0; i < s->count; i++) {
        const uint32_t *v = d->triangles[s->triangles[i]].corner;
        if (v[0] == to || v[1] == to || v[2] == to)
            continue;
        for (k = 0; k < 3u; k++)
            f->corner[f->count][k] = v[k] == from ? to : v[k];
        if (!(terrimpi_depth_area(d, f->corner[f->count]) > 0.25f))
            return 0;
        f->triangles[f->count++] = s->triangles[i];
    }
    return 1;
}

/* Whether all that a star stands for is still met by the fan; if so, that is dealt out anew. */
static int terrimpi_depth_covers(terrimpi_depth *d, const terrimpi_depth_star *s,
                                 const terrimpi_depth_fan *f)
{
    float limit = d->tolerance * d->tolerance;
    uint32_t i, k, p, at = 0, n = 0;
    for (i = 0; i < s->count; i++)
        for (p = d->triangles[s->triangles[i]].points; p != TERRIMPI_DEPTH_END;
             p = d->points[p].next) {
            for (k = 0; k < f->all; k++) { /* neighbours mostly go to the same one */
                const uint32_t *v = at < f->count ? f->corner[at]
                                                  : d->triangles[f->triangles[at]].corner;
                if (terrimpi_depth_gap(d, &d->points[p], v) <= limit)
                    break;
                at = at + 1u < f->all ? at + 1u : 0u;
            }
            if (k == f->all)
                return 0;
            d->points[p].fan = (uint16_t)at;
            d->queue[n++] = p;
        }
    for (i = 0; i < s->count; i++)
        d->triangles[s->triangles[i]].points = TERRIMPI_DEPTH_END;
    for (i = 0; i < n; i++)
        terrimpi_depth_give(d, d->queue[i], f->triangles[d->points[d->queue[i]].fan]);
    return 1;
}

/* Whether an edge of a star may collapse as far as its topology goes: seams move by no more than
   the tolerance in the picture, borders by a texel: more would show eyes what is behind them. */
static int terrimpi_depth_may(terrimpi_depth *d, const terrimpi_depth_star *s, uint32_t from,
                              uint32_t n, const terrimpi_depth_star *t)
{
    uint32_t i, k, common = 0;
    if (s->open_count && (!s->open[n] || s->open_count != 2u))
        return 0;
    for (i = 0; i < s->other_count; i++)
        for (k = 0; k < t->other_count; k++)
            common += s->others[i] == t->others[k];
    if (common != s->shared[n])
        return 0;
    for (i = 0; i < s->other_count; i++)
        if (s->open_count && s->open[i] && i != n) {
            int border = s->shared[n] == 1u && s->shared[i] == 1u;
            float flat[3][3], limit = border ? terrimpi_min(d->tolerance, 1.0f) : d->tolerance;
            memcpy(flat[0], terrimpi_depth_at(d, from), sizeof flat[0]);
            memcpy(flat[1], terrimpi_depth_at(d, s->others[n]), sizeof flat[0]);
            memcpy(flat[2], terrimpi_depth_at(d, s->others[i]), sizeof flat[0]);
            flat[0][2] = flat[1][2] = flat[2][2] = 0.0f;
            return terrimpi_depth_to_edge(flat[0], flat[1], flat[2]) <= limit * limit;
        }
    return 1;
}

/* Moves a vertex to its n-th neighbour if the mesh stays as it should; -1: not yet, for edges would
   become much longer than the longest that now collapse, and thin triangles with them. */
static int terrimpi_depth_collapse(terrimpi_depth *d, const terrimpi_depth_star *s, uint32_t from,
                                   uint32_t n, float longest)
{
    terrimpi_depth_star t;
    terrimpi_depth_fan f;
    uint32_t to = s->others[n], i, k;
    for (i = 0; i < s->other_count; i++)
        if (terrimpi_depth_length(d, to, s->others[i]) > 2.0f * longest)
            return -1;
    if (!terrimpi_depth_fan_of(d, s, from, to, &f) || !terrimpi_depth_collect(d, to, &t) ||
        !terrimpi_depth_may(d, s, from, n, &t))
        return 0;
    for (i = 0, f.all = f.count; i < t.count; i++) {
        const uint32_t *v = d->triangles[t.triangles[i]].corner;
        if (v[0] != from && v[1] != from && v[2] != from)
            f.triangles[f.all++] = t.triangles[i];
    }
    for (i = 0; i < f.count; i++)
        if (!terrimpi_depth_on_texels(d, f.corner[i]))
            return 0;
    if (!terrimpi_depth_covers(d, s, &f))
        return 0;
    for (i = 0; i < s->count; i++)
        d->triangles[s->triangles[i]].corner[0] = TERRIMPI_DEPTH_END;
    for (i = 0; i < f.count; i++) { /* in its old place, so that what it stands for stays with it */
        uint32_t triangle = f.triangles[i];
        memcpy(d->triangles[triangle].corner, f.corner[i], sizeof f.corner[i]);
        for (k = 0; k < 3u; k++)
            if (f.corner[i][k] == to) {
                d->triangles[triangle].next[k] = d->at[to];
                d->at[to] = 3u * triangle + k;
            }
    }
    d->at[from] = TERRIMPI_DEPTH_END;
    d->stale[to] = 0;
    for (i = 0; i < s->other_count; i++)
        d->stale[s->others[i]] = 0;
    return 1;
}

/* Collapses edges up to a length, each vertex to the closest neighbour that it may go to. Where
   nothing has changed only edges are tried that were too long before. */
static uint32_t terrimpi_depth_pass(terrimpi_depth *d, float before, float longest)
{
    terrimpi_depth_star s;
    uint32_t vertex, i, done = 0;
    for (vertex = 0; vertex < d->corner_count; vertex++) {
        float lengths[2u * TERRIMPI_DEPTH_STAR];
        uint32_t next;
        int collapsed = 0;
        if (d->at[vertex] == TERRIMPI_DEPTH_END || !terrimpi_depth_collect(d, vertex, &s))
            continue;
        for (i = 0; i < s.other_count; i++) {
            lengths[i] = terrimpi_depth_length(d, vertex, s.others[i]);
            if (lengths[i] > longest || (d->stale[vertex] && lengths[i] <= before))
                lengths[i] = 0.0f; /* not to be tried, or no more */
        }
        d->stale[vertex] = 1;
        while (collapsed <= 0) {
            for (i = 0, next = 0; i < s.other_count; i++)
                if (lengths[i] > 0.0f && (!(lengths[next] > 0.0f) || lengths[i] < lengths[next]))
                    next = i;
            if (!s.other_count || !(lengths[next] > 0.0f))
                break;
            lengths[next] = 0.0f;
            collapsed = terrimpi_depth_collapse(d, &s, vertex, next, longest);
            if (collapsed < 0)
                d->stale[vertex] = 0;
            done += collapsed > 0;
        }
    }
    return done;
}

static void terrimpi_depth_simplify(terrimpi_depth *d)
{
    float end = 2.0f * (float)(d->desc->width + d->desc->height + d->desc->layers);
    float before = 0.0f, longest;
    memset(d->stale, 0, d->corner_count);
    for (longest = 1.5f; before < end; longest *= 1.4f) {
        while (terrimpi_depth_pass(d, before, longest) > d->corner_count / 1000u) {}
        before = longest;
    }
}

/* Writes the triangles sheet by sheet, the vertices in the order in which they are met. */
static void terrimpi_depth_write_mesh(terrimpi_depth *d, terrimp_depth_mesh *m)
{
    uint32_t i, k, sheet, *first = d->joined; /* [sheets + 1] */
    uint32_t *name = d->queue;                /* [corners] */
    memset(first, 0, (d->sheet_count + 1u) * sizeof *first);
    memset(name, 0xff, d->corner_count * sizeof *name);
    m->vertex_count = m->index_count = 0;
    for (i = 0; i < d->triangle_count; i++)
        if (d->triangles[i].corner[0] != TERRIMPI_DEPTH_END)
            first[d->triangles[i].sheet + 1u] += 3u;
    for (sheet = 0; sheet < d->sheet_count; sheet++) {
        first[sheet + 1u] += first[sheet];
        if (sheet < m->sheet_capacity) {
            m->sheets[sheet].first_index = first[sheet];
            m->sheets[sheet].index_count = first[sheet + 1u] - first[sheet];
        }
    }
    for (i = 0; i < d->triangle_count; i++) {
        const terrimpi_depth_triangle *t = &d->triangles[i];
        if (t->corner[0] == TERRIMPI_DEPTH_END)
            continue;
        for (k = 0; k < 3u; k++) {
            uint32_t vertex = t->corner[k], at = first[t->sheet]++;
            if (name[vertex] == TERRIMPI_DEPTH_END) {
                name[vertex] = m->vertex_count++;
                if (name[vertex] < m->vertex_capacity) {
                    m->vertices[name[vertex]].u = d->corners[vertex].at[0];
                    m->vertices[name[vertex]].v = d->corners[vertex].at[1];
                    m->vertices[name[vertex]].layer = d->corners[vertex].at[2];
                }
            }
            if (at < m->index_capacity)
                m->indices[at] = name[vertex];
            m->index_count++;
        }
    }
}

/* Rectangles of the sheets, and from which layer their texels have their colours. */
static void terrimpi_depth_write_sheets(terrimpi_depth *d, terrimp_depth_mesh *m)
{
    uint32_t i, sheet;
    m->sheet_count = d->sheet_count;
    m->texel_count = 0;
    if (d->sheet_count > m->sheet_capacity)
        return;
    for (i = 0; i < d->sheet_count; i++)
        m->sheets[i].texels = terrimpi_rect(0, 0, 0, 0);
    for (i = 0; i < d->cell_count; i++) {
        terrimp_rect *r = &m->sheets[d->cells[i].sheet].texels;
        terrimp_rect cell = terrimpi_rect(d->cells[i].x, d->cells[i].y, 1, 1);
        *r = r->width ? terrimpi_cover_union(r, &cell) : cell;
    }
    for (sheet = 0; sheet < d->sheet_count; sheet++) {
        m->sheets[sheet].first_texel = m->texel_count;
        m->texel_count += m->sheets[sheet].texels.width * m->sheets[sheet].texels.height;
    }
    if (m->texel_count > m->texel_capacity)
        return;
    memset(m->texel_layers, 0xff, m->texel_count * sizeof *m->texel_layers);
    for (i = 0; i < d->cell_count; i++) {
        const terrimpi_depth_cell *c = &d->cells[i];
        const terrimp_depth_sheet *s = &m->sheets[c->sheet];
        uint32_t k = c->k0;
        while (k < c->k1 && !terrimpi_depth_set(d->desc, d->desc->visible, c->x, c->y, k))
            k++;
        m->texel_layers[s->first_texel + (c->y - s->texels.y) * s->texels.width + c->x -
                        s->texels.x] = (uint16_t)k;
    }
}

static terrimp_result terrimpi_depth_check(const terrimp_depth_mesh_desc *desc, terrimpi_depth *d)
{
    TERRIMPI_REFUSE(!desc || !desc->opaque || !desc->visible, TERRIMP_E_NULL);
    d->desc = desc;
    d->tolerance = desc->tolerance;
    TERRIMPI_DEFAULT(d->tolerance, 1.0f);
    return terrimpi_within_u32(desc->width, 1, 16384) &&
                   terrimpi_within_u32(desc->height, 1, 16384) &&
                   terrimpi_within_u32(desc->layers, 1, 65535) &&
                   terrimpi_within(d->tolerance, 0.75f, 64.0f)
               ? TERRIMP_OK : TERRIMP_E_RANGE;
}

/* Lays out the scratch memory, for cells and texels that have been counted. */
static size_t terrimpi_depth_layout(terrimpi_depth *d, void *base)
{
    terrimpi_arena arena = terrimpi_arena_at(base);
    size_t n = d->cell_count, points = (size_t)d->point_count + d->cell_count;
    size_t slots = (size_t)d->desc->width * d->desc->height;
    size_t most = terrimpi_mul(8, n, &arena.ok);
    size_t queue = most > points ? most : points;
    arena.ok &= n < 0x10000000u;
    d->cells = (terrimpi_depth_cell *)terrimpi_take(&arena, n, sizeof *d->cells);
    d->beside = (uint32_t *)terrimpi_take(&arena, most / 2u, sizeof *d->beside);
    d->first_cell = (uint32_t *)terrimpi_take(&arena, slots + 1u, sizeof *d->first_cell);
    d->joined = (uint32_t *)terrimpi_take(&arena, most / 2u + 2u, sizeof *d->joined);
    d->vertex_of = (uint32_t *)terrimpi_take(&arena, most / 2u, sizeof *d->vertex_of);
    d->corners = (terrimpi_depth_corner *)terrimpi_take(&arena, most, sizeof *d->corners);
    d->triangles =
        (terrimpi_depth_triangle *)terrimpi_take(&arena, most / 2u, sizeof *d->triangles);
    d->points = (terrimpi_depth_point *)terrimpi_take(&arena, points, sizeof *d->points);
    d->at = (uint32_t *)terrimpi_take(&arena, most > slots ? most : slots, sizeof *d->at);
    d->stale = (uint8_t *)terrimpi_take(&arena, most, 1);
    d->queue = (uint32_t *)terrimpi_take(&arena, queue, sizeof *d->queue);
    return arena.ok ? arena.bytes : 0;
}

TERRIMP_API size_t terrimp_depth_mesh_scratch_bytes(const terrimp_depth_mesh_desc *desc)
{
    terrimpi_depth d;
    if (terrimpi_depth_check(desc, &d) != TERRIMP_OK)
        return 0;
    terrimpi_depth_cells(&d, 0);
    return terrimpi_depth_layout(&d, NULL);
}

TERRIMP_API terrimp_result terrimp_depth_mesh_make(const terrimp_depth_mesh_desc *desc,
                                                   void *scratch, size_t bytes,
                                                   terrimp_depth_mesh *mesh)
{
    terrimpi_depth d;
    size_t needed;
    TERRIMPI_TRY(terrimpi_depth_check(desc, &d));
    TERRIMPI_REFUSE(!scratch || !mesh || !mesh->vertices || !mesh->indices || !mesh->sheets ||
                    !mesh->texel_layers, TERRIMP_E_NULL);
    TERRIMPI_REFUSE((uintptr_t)scratch % TERRIMPI_ALIGN, TERRIMP_E_ALIGN);
    terrimpi_depth_cells(&d, 0);
    needed = terrimpi_depth_layout(&d, scratch);
    TERRIMPI_REFUSE(!needed || bytes < needed, TERRIMP_E_MEMORY);
    terrimpi_depth_cells(&d, 1);
    terrimpi_depth_match(&d);
    terrimpi_depth_connect(&d);
    terrimpi_depth_sheets(&d);
    terrimpi_depth_first_mesh(&d);
    mesh->first_triangle_count = d.triangle_count;
    terrimpi_depth_simplify(&d);
    terrimpi_depth_write_mesh(&d, mesh);
    terrimpi_depth_write_sheets(&d, mesh);
    return mesh->vertex_count > mesh->vertex_capacity ||
                   mesh->index_count > mesh->index_capacity ||
                   mesh->sheet_count > mesh->sheet_capacity ||
                   mesh->texel_count > mesh->texel_capacity
               ? TERRIMP_E_CAPACITY : TERRIMP_OK;
}

/* --- layers all round a cell, and for all views of an object --- */

TERRIMP_API terrimp_result terrimp_layers_around(const terrimp_layers_desc *desc,
                                                 const float centre[3], float half,
                                                 terrimp_layers *layers,
                                                 terrimp_capture pictures[6])
{
    terrimp_layers_desc d;
    terrimp_layers made;
    uint32_t side, k;
    TERRIMPI_REFUSE(!desc || !centre || !layers || !pictures, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(centre) || !terrimpi_finite(half), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(half > 0.0f) || !(desc->distance > 0.0f), TERRIMP_E_RANGE);
    d = *desc;
    for (k = 0; k < 2u; k++) { /* at depth t the pyramid is t + half wide to each side */
        d.cell_size[k] = 2.0f * half;
        d.cell_tan[k] = 0.0f;
        d.view_tan[k] = 1.0f + half / desc->distance;
    }
    d.cell_depth = 2.0f * half;
    TERRIMPI_TRY(terrimp_layers_plan(&d, &made));
    *layers = made;
    for (side = 0; side < 6u; side++) {
        terrimp_capture *p = &pictures[side];
        memset(p, 0, sizeof *p);
        p->forward[side / 2u] = side & 1u ? -1.0f : 1.0f;
        p->up[1] = 1.0f;
        terrimpi_basis(p->forward, p->up, p->right);
        for (k = 0; k < 3u; k++)
            p->eye[k] = centre[k] + half * p->forward[k];
        p->z_near = made.start;
        p->z_far = made.end;
        p->tan_right = p->tan_up = d.view_tan[0];
        p->tan_left = p->tan_down = -d.view_tan[0];
    }
    return TERRIMP_OK;
}

TERRIMP_API terrimp_result terrimp_layers_object(const terrimp_box *box, float texel, float slope,
                                                 uint32_t counts[3])
{
    float needed[3];
    int k;
    TERRIMPI_REFUSE(!box || !counts, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!terrimpi_finite3(box->min) || !terrimpi_finite3(box->max) ||
                    !terrimpi_finite2(texel, slope), TERRIMP_E_NOT_FINITE);
    TERRIMPI_REFUSE(!(texel > 0.0f) || !(slope >= 1.0f), TERRIMP_E_RANGE);
    for (k = 0; k < 3; k++) {
        needed[k] = (box->max[k] - box->min[k]) * slope / texel;
        TERRIMPI_REFUSE(!(needed[k] >= 0.0f) || !(needed[k] < TERRIMPI_LAYERS_MAX),
                        TERRIMP_E_RANGE);
    }
    for (k = 0; k < 3; k++)
        counts[k] = terrimpi_max_u32(1u, terrimpi_ceil_u32(needed[k]));
    return TERRIMP_OK;
}

/* ==== Placement ========================================================== >>impl-placement */
/* Based on: Jeschke 2004, chapter 5. */

#define TERRIMPI_PLACE_NONE 0xffffffffu
enum { TERRIMPI_PLACE_NEVER = 1, TERRIMPI_PLACE_FIRST }; /* is chosen; 0: by its score */
#define TERRIMPI_PLACE_WORK 3000000u /* numbers that attempts may go over, some 10 ns each */

typedef struct terrimpi_place_work {
    const terrimp_place_desc *desc;
    float *costs;       /* [view_count] as they are now */
    uint8_t *shown;     /* [gain_count] */
    float *scores;      /* [candidate_count] gain for memory when it was last looked at */
    uint32_t *heap;     /* [candidate_count] the best score first */
    uint32_t *cluster;  /* [gain_count] */
    uint32_t *first;    /* [view_count + 1] where the gains of each view begin in list */
    uint32_t *count;    /* [view_count] those that are shown */
    uint32_t *list;     /* [gain_count] these gains */
    uint32_t *rank;     /* [cluster_count] see terrimpi_place_rank */
    uint32_t *low;      /* [cluster_count] */
    uint32_t heap_count;
    uint8_t *wish;      /* [candidate_count] TERRIMPI_PLACE_... */
    uint8_t *best;      /* [gain_count] what the best attempt shows */
    uint8_t *made;      /* [gain_count] its picture's memory is paid for */
    uint32_t *spare;    /* [view_count] gains of those, as a list: */
    uint32_t *another;  /* [gain_count] */
    uint32_t *log;      /* [3 * gain_count] gains that were shown or hidden, to be undone */
    uint32_t log_count;
} terrimpi_place_work;

static size_t terrimpi_place_layout(const terrimp_place_desc *d, void *base, terrimpi_place_work *p)
{
    terrimpi_arena arena = terrimpi_arena_at(base);
    p->desc = d;
    p->scores = (float *)terrimpi_take(&arena, d->candidate_count, sizeof *p->scores);
    p->heap = (uint32_t *)terrimpi_take(&arena, d->candidate_count, sizeof *p->heap);
    p->cluster = (uint32_t *)terrimpi_take(&arena, d->gain_count, sizeof *p->cluster);
    p->first = (uint32_t *)terrimpi_take(&arena, (size_t)d->view_count + 1u, sizeof *p->first);
    p->count = (uint32_t *)terrimpi_take(&arena, d->view_count, sizeof *p->count);
    p->list = (uint32_t *)terrimpi_take(&arena, d->gain_count, sizeof *p->list);
    p->rank = (uint32_t *)terrimpi_take(&arena, d->cluster_count, sizeof *p->rank);
    p->low = (uint32_t *)terrimpi_take(&arena, d->cluster_count, sizeof *p->low);
    p->wish = (uint8_t *)terrimpi_take(&arena, d->candidate_count, 1);
    p->best = (uint8_t *)terrimpi_take(&arena, d->gain_count, 1);
    p->made = (uint8_t *)terrimpi_take(&arena, d->gain_count, 1);
    p->spare = (uint32_t *)terrimpi_take(&arena, d->view_count, sizeof *p->spare);
    p->another = (uint32_t *)terrimpi_take(&arena, d->gain_count, sizeof *p->another);
    p->log = (uint32_t *)terrimpi_take(&arena, d->gain_count, 3 * sizeof *p->log);
    return arena.ok ? arena.bytes + TERRIMPI_ALIGN : 0;
}

TERRIMP_API size_t terrimp_place_scratch_bytes(const terrimp_place_desc *desc)
{
    terrimpi_place_work p;
    return desc ? terrimpi_place_layout(desc, NULL, &p) : 0;
}

/* Ranks the clusters so that those within one have the ranks from above low to its own. */
static void terrimpi_place_rank(terrimpi_place_work *p)
{
    const uint32_t *parents = p->desc->parents;
    uint32_t i, roots = p->desc->cluster_count;
    for (i = 0; i < p->desc->cluster_count; i++)
        p->low[i] = 1;
    for (i = 0; i < p->desc->cluster_count; i++) /* parents have greater numbers */
        if (parents[i] != i)
            p->low[parents[i]] += p->low[i];
    while (i-- > 0) {
        uint32_t *end = parents[i] == i ? &roots : &p->low[parents[i]], count = p->low[i];
        p->rank[i] = *end;
        p->low[i] = *end - 1u;
        *end -= count;
    }
}

/* Whether a cluster is another one or lies within it. */
static int terrimpi_place_within(const terrimpi_place_work *p, uint32_t cluster, uint32_t other)
{
    return p->rank[other] - p->rank[cluster] < p->rank[other] - p->low[other];
}

/* What a picture would take off a view's cost: less what pictures of the same cluster or its parts
   have, whose place it takes; nothing when one of a larger cluster shows it. */
static float terrimpi_place_net(const terrimpi_place_work *p, uint32_t gain)
{
    const terrimp_place_gain *g = &p->desc->gains[gain];
    const uint32_t *list = p->list + p->first[g->view];
    uint32_t cluster = p->cluster[gain], i;
    float net = g->saved;
    for (i = p->count[g->view]; i-- > 0;) {
        uint32_t other = p->cluster[list[i]];
        if (terrimpi_place_within(p, other, cluster))
            net -= p->desc->gains[list[i]].saved;
        else if (terrimpi_place_within(p, cluster, other))
            return 0.0f;
    }
    return net;
}

/* But for rounding: costs are added to and taken from many times. */
static int terrimpi_place_solved(const terrimpi_place_work *p, float cost)
{
    return cost <= p->desc->budget + 1e-5f * terrimpi_abs(p->desc->budget);
}

/* What of that counts: nothing below the budget does (his equation 5.4). */
static float terrimpi_place_useful(const terrimpi_place_work *p, uint32_t gain)
{
    float cost = p->costs[p->desc->gains[gain].view], over = cost - p->desc->budget;
    return !terrimpi_place_solved(p, cost) && p->desc->gains[gain].saved > 0.0f
               ? terrimpi_max(0.0f, terrimpi_min(over, terrimpi_place_net(p, gain)))
               : 0.0f;
}

static float terrimpi_place_score(const terrimpi_place_work *p, uint32_t candidate)
{
    const terrimp_place_candidate *c = &p->desc->candidates[candidate];
    float sum = 0.0f;
    uint32_t i;
    for (i = 0; i < c->gain_count; i++)
        sum += terrimpi_place_useful(p, c->first_gain + i);
    return sum / c->memory;
}

static int terrimpi_place_better(const terrimpi_place_work *p, uint32_t a, uint32_t b)
{
    return p->scores[a] > p->scores[b] || (!(p->scores[a] < p->scores[b]) && a < b);
}

static void terrimpi_place_sink(terrimpi_place_work *p, uint32_t at)
{
    uint32_t item = p->heap[at];
    for (;;) {
        uint32_t child = 2u * at + 1u;
        if (child + 1u < p->heap_count &&
            terrimpi_place_better(p, p->heap[child + 1u], p->heap[child]))
            child++;
        if (child >= p->heap_count || !terrimpi_place_better(p, p->heap[child], item))
            break;
        p->heap[at] = p->heap[child];
        at = child;
    }
    p->heap[at] = item;
}

/* Shows a gain in its view that was not shown, or the reverse. */
static void terrimpi_place_toggle(terrimpi_place_work *p, uint32_t gain)
{
    const terrimp_place_gain *g = &p->desc->gains[gain];
    uint32_t *list = p->list + p->first[g->view], *count = &p->count[g->view], i;
    p->log[p->log_count++] = gain;
    p->shown[gain] = !p->shown[gain];
    if (p->shown[gain]) {
        list[(*count)++] = gain;
        p->costs[g->view] -= g->saved;
        return;
    }
    for (i = 0; list[i] != gain; i++) {}
    list[i] = list[--*count];
    p->costs[g->view] += g->saved;
}

/* Shows a picture in a view, in place of those of the same cluster and its parts. */
static void terrimpi_place_show(terrimpi_place_work *p, uint32_t gain)
{
    uint32_t view = p->desc->gains[gain].view, i;
    const uint32_t *list = p->list + p->first[view];
    for (i = p->count[view]; i-- > 0;)
        if (terrimpi_place_within(p, p->cluster[list[i]], p->cluster[gain]))
            terrimpi_place_toggle(p, list[i]);
    terrimpi_place_toggle(p, gain);
}

/* Shows a candidate wherever it is of use. */
static void terrimpi_place_choose(terrimpi_place_work *p, uint32_t candidate)
{
    const terrimp_place_candidate *c = &p->desc->candidates[candidate];
    uint32_t i;
    p->log_count = 0;
    for (i = c->first_gain; i < c->first_gain + c->gain_count; i++)
        if (terrimpi_place_useful(p, i) > 0.0f)
            terrimpi_place_show(p, i);
}

static void terrimpi_place_greedily(terrimpi_place_work *p)
{
    uint32_t i;
    for (i = 0; i < p->desc->candidate_count; i++)
        if (p->wish[i] == TERRIMPI_PLACE_FIRST)
            terrimpi_place_choose(p, i);
    p->heap_count = 0;
    for (i = 0; i < p->desc->candidate_count; i++) {
        p->scores[i] = p->wish[i] ? 0.0f : terrimpi_place_score(p, i);
        if (p->scores[i] > 0.0f)
            p->heap[p->heap_count++] = i;
    }
    for (i = p->heap_count / 2u; i-- > 0;)
        terrimpi_place_sink(p, i);
    while (p->heap_count) {
        uint32_t best = p->heap[0];
        float score = terrimpi_place_score(p, best);
        int fell = score < p->scores[best];
        p->scores[best] = score;
        if (!fell)
            terrimpi_place_choose(p, best);
        if (!fell || !(score > 0.0f))
            p->heap[0] = p->heap[--p->heap_count];
        if (p->heap_count)
            terrimpi_place_sink(p, 0);
    }
}

/* Whether a candidate is shown anywhere. */
static int terrimpi_place_uses(const terrimpi_place_work *p, const uint8_t *shown,
                               uint32_t candidate)
{
    const terrimp_place_candidate *c = &p->desc->candidates[candidate];
    return c->gain_count && memchr(shown + c->first_gain, 1, c->gain_count) != NULL;
}

/* Brings a view back to a cost, with pictures that are paid for; returns whether that worked. */
static int terrimpi_place_stand_in(terrimpi_place_work *p, uint32_t view, float cost)
{
    while (!terrimpi_place_solved(p, p->costs[view]) && p->costs[view] > cost) {
        uint32_t i, best = TERRIMPI_PLACE_NONE;
        float most = 0.0f;
        for (i = p->spare[view]; i != TERRIMPI_PLACE_NONE; i = p->another[i]) {
            float useful = terrimpi_place_useful(p, i);
            if (useful > most && p->made[i] && !p->shown[i]) {
                most = useful;
                best = i;
            }
        }
        if (best == TERRIMPI_PLACE_NONE)
            return 0;
        terrimpi_place_show(p, best);
    }
    return 1;
}

/* Does without a candidate, if no view comes to cost more than the budget by that. */
static void terrimpi_place_drop(terrimpi_place_work *p, uint32_t candidate)
{
    const terrimp_place_candidate *c = &p->desc->candidates[candidate];
    uint32_t i;
    p->log_count = 0;
    memset(p->made + c->first_gain, 0, c->gain_count);
    for (i = c->first_gain; i < c->first_gain + c->gain_count; i++) {
        uint32_t view = p->desc->gains[i].view;
        float cost = p->costs[view];
        if (!p->shown[i])
            continue;
        terrimpi_place_toggle(p, i);
        if (terrimpi_place_stand_in(p, view, cost))
            continue;
        for (i = p->log_count; i-- > 0;) {
            p->log_count = i; /* where undoing is noted, and forgotten */
            terrimpi_place_toggle(p, p->log[i]);
        }
        memset(p->made + c->first_gain, 1, c->gain_count);
        return;
    }
}

static int terrimpi_place_smaller(const void *candidates, uint32_t a, uint32_t b)
{
    const terrimp_place_candidate *c = (const terrimp_place_candidate *)candidates;
    return c[a].memory < c[b].memory;
}

/* Lists, view by view, what pictures that are paid for could do; then gives back those that others
   can stand in for, the largest first. */
static void terrimpi_place_give_back(terrimpi_place_work *p)
{
    const terrimp_place_candidate *c = p->desc->candidates;
    uint32_t i, count = 0;
    memset(p->spare, 0xff, p->desc->view_count * sizeof *p->spare);
    memset(p->made, 0, p->desc->gain_count);
    for (i = 0; i < p->desc->candidate_count; i++)
        if (terrimpi_place_uses(p, p->shown, i)) {
            memset(p->made + c[i].first_gain, 1, c[i].gain_count);
            p->heap[count++] = i;
        }
    for (i = p->desc->gain_count; i-- > 0;)
        if (p->made[i]) {
            p->another[i] = p->spare[p->desc->gains[i].view];
            p->spare[p->desc->gains[i].view] = i;
        }
    terrimpi_sort(p->heap, count, c, terrimpi_place_smaller);
    for (i = 0; i < count; i++)
        terrimpi_place_drop(p, p->heap[i]);
}

static terrimp_result terrimpi_place_check(const terrimp_place_desc *d)
{
    uint32_t i;
    TERRIMPI_REFUSE(!terrimpi_finite(d->budget), TERRIMP_E_NOT_FINITE);
    for (i = 0; i < d->cluster_count; i++)
        TERRIMPI_REFUSE(d->parents[i] < i || d->parents[i] >= d->cluster_count, TERRIMP_E_RANGE);
    for (i = 0; i < d->view_count; i++)
        TERRIMPI_REFUSE(!terrimpi_finite(d->costs[i]), TERRIMP_E_NOT_FINITE);
    for (i = 0; i < d->gain_count; i++) {
        TERRIMPI_REFUSE(!terrimpi_finite(d->gains[i].saved), TERRIMP_E_NOT_FINITE);
        TERRIMPI_REFUSE(d->gains[i].view >= d->view_count, TERRIMP_E_RANGE);
    }
    for (i = 0; i < d->candidate_count; i++) {
        const terrimp_place_candidate *c = &d->candidates[i];
        TERRIMPI_REFUSE(!terrimpi_finite(c->memory), TERRIMP_E_NOT_FINITE);
        TERRIMPI_REFUSE(!(c->memory > 0.0f) || c->cluster >= d->cluster_count ||
                        c->first_gain > d->gain_count ||
                        c->gain_count > d->gain_count - c->first_gain, TERRIMP_E_RANGE);
    }
    return TERRIMP_OK;
}

static void terrimpi_place_sum(const terrimpi_place_work *p, terrimp_placement *out)
{
    uint32_t i;
    memset(out, 0, sizeof *out);
    for (i = 0; i < p->desc->view_count; i++) {
        out->problems += !terrimpi_place_solved(p, p->desc->costs[i]);
        out->unsolved += !terrimpi_place_solved(p, p->costs[i]);
    }
    for (i = 0; i < p->desc->candidate_count; i++)
        if (terrimpi_place_uses(p, p->shown, i)) {
            out->chosen++;
            out->memory += p->desc->candidates[i].memory;
        }
}

/* Places from the beginning, as wished. */
static void terrimpi_place_attempt(terrimpi_place_work *p, terrimp_placement *out)
{
    memcpy(p->costs, p->desc->costs, p->desc->view_count * sizeof *p->costs);
    memset(p->shown, 0, p->desc->gain_count);
    memset(p->count, 0, p->desc->view_count * sizeof *p->count);
    terrimpi_place_greedily(p);
    terrimpi_place_give_back(p);
    terrimpi_place_sum(p, out);
}

/* Attempts to do the reverse with one or two candidates, to be made or not, as long as that pays
   and work is left to spend: each candidate alone, then all pairs. The others are chosen anew, in
   the next round beginning with those that are made now. */
static void terrimpi_place_improve(terrimpi_place_work *p, terrimp_placement *best)
{
    uint32_t n = p->desc->candidate_count, start = 0, turn = 0, i;
    uint32_t tries = TERRIMPI_PLACE_WORK / (p->desc->gain_count + p->desc->view_count + n + 1u);
    while (n > 0 && turn / n <= n && tries-- > 0) {
        uint32_t a = (start + turn) % n, b = (a + turn / n / 2u) % n, keep = turn / n % 2u;
        terrimp_placement attempt;
        for (i = 0; i < n; i++) {
            int made = terrimpi_place_uses(p, p->best, i), reverse = i == a || i == b;
            p->wish[i] = reverse ? (made ? TERRIMPI_PLACE_NEVER : TERRIMPI_PLACE_FIRST)
                                 : (made && keep ? TERRIMPI_PLACE_FIRST : 0);
        }
        terrimpi_place_attempt(p, &attempt);
        turn++;
        if (attempt.unsolved < best->unsolved ||
            (attempt.unsolved == best->unsolved && attempt.memory < best->memory)) {
            *best = attempt;
            memcpy(p->best, p->shown, p->desc->gain_count);
            start = a + 1u;
            turn = 0;
        }
    }
}

TERRIMP_API terrimp_result terrimp_place(const terrimp_place_desc *desc, void *scratch,
                                         size_t bytes, uint8_t *shown, float *costs,
                                         terrimp_placement *placement)
{
    terrimpi_place_work p;
    uint32_t i, k;
    TERRIMPI_REFUSE(!desc || !scratch || !shown || !costs || !placement, TERRIMP_E_NULL);
    TERRIMPI_REFUSE(!desc->candidates || !desc->gains || !desc->parents || !desc->costs,
                    TERRIMP_E_NULL);
    TERRIMPI_REFUSE((uintptr_t)scratch % TERRIMPI_ALIGN, TERRIMP_E_ALIGN);
    TERRIMPI_TRY(terrimpi_place_check(desc));
    TERRIMPI_REFUSE(bytes < terrimp_place_scratch_bytes(desc) ||
                    !terrimpi_place_layout(desc, scratch, &p), TERRIMP_E_MEMORY);
    p.costs = costs;
    p.shown = shown;
    memset(p.wish, 0, desc->candidate_count);
    memset(p.cluster, 0xff, desc->gain_count * sizeof *p.cluster); /* gains may be nobody's */
    for (i = 0; i < desc->candidate_count; i++)
        for (k = 0; k < desc->candidates[i].gain_count; k++) {
            uint32_t *cluster = &p.cluster[desc->candidates[i].first_gain + k];
            TERRIMPI_REFUSE(*cluster != TERRIMPI_PLACE_NONE, TERRIMP_E_RANGE);
            *cluster = desc->candidates[i].cluster;
        }
    terrimpi_place_rank(&p);
    memset(p.first, 0, ((size_t)desc->view_count + 1u) * sizeof *p.first);
    for (i = 0; i < desc->gain_count; i++)
        p.first[desc->gains[i].view + 1u]++;
    for (i = 0; i < desc->view_count; i++)
        p.first[i + 1u] += p.first[i];
    terrimpi_place_attempt(&p, placement);
    memcpy(p.best, shown, desc->gain_count);
    terrimpi_place_improve(&p, placement);
    memcpy(shown, p.best, desc->gain_count);
    memcpy(costs, desc->costs, desc->view_count * sizeof *costs);
    for (i = 0; i < desc->gain_count; i++)
        if (shown[i])
            costs[desc->gains[i].view] -= desc->gains[i].saved;
    return TERRIMP_OK;
}

/* --- a prepared set for a terrain --- */

typedef struct terrimpi_prepare {
    terrimp_place_terrain_desc desc; /* resolved */
    terrimp_place_set *set;
    uint32_t cells, nodes, squares;  /* along a side; all; of all sizes */
    float *worth;       /* [nodes] what the node costs as ground in a view */
    uint8_t *whole;     /* [nodes] ground of the cell draws it, and none of its parts */
    uint8_t *below;     /* [nodes] of such a node */
    uint32_t *list;     /* [squares] those whose pictures may serve a cell */
    uint8_t *serves;    /* [squares][nodes] of that list: whether they do */
    uint32_t *slots;    /* [squares][nodes] gains of that picture, later where the next one goes;
                           TERRIMPI_PLACE_NONE: it cannot be prepared */
} terrimpi_prepare;

static float terrimpi_prepare_distance(const terrimp_box *a, const terrimp_box *b)
{
    float gap[3];
    int k;
    for (k = 0; k < 3; k++)
        gap[k] = terrimpi_max(0.0f, terrimpi_max(a->min[k] - b->max[k], b->min[k] - a->max[k]));
    return terrimpi_length(gap);
}

/* A square by its number, and its box of eyes: those of one cell come first, row by row, then those
   of 2 x 2 cells, and so on. */
static void terrimpi_prepare_square(const terrimpi_prepare *p, uint32_t square,
                                    terrimp_place_picture *out, terrimp_box *box)
{
    uint32_t side = p->cells;
    float width, depth;
    for (out->level = 0; square >= side * side; out->level++) {
        square -= side * side;
        side /= 2u;
    }
    out->x = square % side;
    out->z = square / side;
    *box = p->desc.eyes;
    width = (box->max[0] - box->min[0]) / (float)side;
    depth = (box->max[2] - box->min[2]) / (float)side;
    box->min[0] += width * (float)out->x;
    box->max[0] = box->min[0] + width;
    box->min[2] += depth * (float)out->z;
    box->max[2] = box->min[2] + depth;
}

static void terrimpi_prepare_middle(const terrimp_box *box, float out[3])
{
    int k;
    for (k = 0; k < 3; k++)
        out[k] = 0.5f * (box->min[k] + box->max[k]);
}

/* Whether a node's picture from the middle of a square can serve all eyes of a box, none of them
   closer to the node than those of the square. Up to r from the middle of that box, and at least d
   from the node, they look at it in directions that differ by r / d from those of its middle, which
   itself sees the picture at some angle. A point that lies `error` off the node's mesh is then seen
   at most K error / d times that many pixels off. */
static int terrimpi_prepare_serves(const terrimpi_prepare *p, const terrimp_box *square,
                                   const terrimp_box *eyes, uint32_t node)
{
    terrimp_box box;
    terrimp_mesh_info mesh;
    float from[3], middle[3], half[3], d, angle, turn;
    if (terrimp_terrain_get_box(p->desc.terrain, node, &box) != TERRIMP_OK ||
        terrimp_terrain_get_mesh(p->desc.terrain, node, &mesh) != TERRIMP_OK)
        return 0;
    d = terrimpi_prepare_distance(eyes, &box);
    terrimpi_prepare_middle(square, from);
    terrimpi_prepare_middle(eyes, middle);
    terrimpi_sub(eyes->max, middle, half);
    turn = terrimpi_length(half) / d;
    return turn <= p->desc.max_angle_rad && d >= terrimpi_prepare_distance(square, &box) &&
           terrimp_view_angle(&box, from, middle, &angle) == TERRIMP_OK &&
           turn + angle <= p->desc.max_angle_rad &&
           p->desc.pixel_factor * mesh.error * (turn + angle) <= p->desc.tolerance_px * d;
}

/* Whether a node's picture from the middle of a square can serve it, and its size. */
static int terrimpi_prepare_picture(const terrimpi_prepare *p, const terrimp_box *square,
                                    uint32_t node, terrimp_place_picture *out)
{
    terrimp_box box;
    terrimp_capture capture;
    uint32_t size[2];
    float closer, scale;
    terrimpi_prepare_middle(square, out->eye);
    if (!terrimpi_prepare_serves(p, square, square, node) ||
        terrimp_terrain_get_box(p->desc.terrain, node, &box) != TERRIMP_OK ||
        terrimp_capture_fit(&box, out->eye, &capture) != TERRIMP_OK)
        return 0;
    closer = terrimp_box_distance(&box, out->eye) / terrimpi_prepare_distance(square, &box);
    if (terrimp_impostor_size(&capture, p->desc.pixel_factor, p->desc.texels_per_px * closer, 1,
                              8192, size, &scale) != TERRIMP_OK || scale < 1.0f)
        return 0;
    out->width = size[0];
    out->height = size[1];
    return 1;
}

/* What ground draws for a cell, node by node: whole where that keeps the tolerance from its closest
   eye. */
static void terrimpi_prepare_ground(const terrimpi_prepare *p, const terrimp_box *cell)
{
    const terrimp_quadtree *tree = &p->desc.terrain->tree;
    uint32_t i;
    for (i = p->nodes; i-- > 0;) {
        terrimp_node n = terrimpi_tree_node(tree, i), parent;
        terrimp_box box;
        terrimpi_mip_error_box(tree, &n, &box);
        p->whole[i] = n.level == 0 ||
                      tree->nodes[i].error * p->desc.pixel_factor <=
                          p->desc.tolerance_px * terrimpi_prepare_distance(cell, &box);
        p->below[i] = 0;
        if (i + 1u == p->nodes)
            continue;
        parent = terrimpi_tree_parent(tree, &n);
        p->below[i] = p->whole[parent.number] || p->below[parent.number];
    }
}

/* Whether some eye of a cell may see a box when it looks into the k-th part of the circle: as if
   cell and box were round. */
static int terrimpi_prepare_sees(const terrimpi_prepare *p, const terrimp_box *cell,
                                 const terrimp_box *box, uint32_t k)
{
    const float circle = 6.2831853f;
    float middle = circle * ((float)k + 0.5f) / (float)p->desc.directions;
    float x = 0.5f * (box->min[0] + box->max[0] - cell->min[0] - cell->max[0]);
    float z = 0.5f * (box->min[2] + box->max[2] - cell->min[2] - cell->max[2]);
    float far_off = terrimpi_layers_hypot(x, z), angle, spread;
    float round = 0.5f * (terrimpi_layers_hypot(box->max[0] - box->min[0],
                                                box->max[2] - box->min[2]) +
                          terrimpi_layers_hypot(cell->max[0] - cell->min[0],
                                                cell->max[2] - cell->min[2]));
    if (!(far_off > round))
        return 1;
    spread = 0.5f * (p->desc.fov_rad + circle / (float)p->desc.directions) +
             TERRIMP_ASINF(round / far_off) + 1e-4f;
    angle = (x * TERRIMP_COSF(middle) + z * TERRIMP_COSF(middle - 0.25f * circle)) / far_off;
    return spread >= 3.1415927f || angle >= TERRIMP_COSF(spread);
}

/* What each node costs as ground in a view. */
static void terrimpi_prepare_worth(const terrimpi_prepare *p, const terrimp_box *cell, uint32_t k)
{
    const terrimp_quadtree *tree = &p->desc.terrain->tree;
    float quads = (float)tree->chunk_quads;
    float own = p->desc.draw_cost + 2.0f * quads * quads * p->desc.triangle_cost;
    uint32_t i;
    for (i = 0; i < p->nodes; i++) {
        terrimp_node n = terrimpi_tree_node(tree, i), children[4];
        terrimp_box box;
        uint32_t count;
        p->worth[i] = 0.0f;
        terrimp_terrain_get_box(p->desc.terrain, i, &box);
        if (!terrimpi_prepare_sees(p, cell, &box, k))
            continue;
        if (p->whole[i]) {
            p->worth[i] = own;
            continue;
        }
        count = terrimpi_tree_children(tree, &n, cell->min, children);
        while (count-- > 0)
            p->worth[i] += p->worth[children[count].number];
    }
}

/* What a node's picture saves in the view at hand. */
static float terrimpi_prepare_saved(const terrimpi_prepare *p, uint32_t node)
{
    terrimp_mesh_info mesh;
    if (p->below[node] || !(p->worth[node] > 0.0f) ||
        terrimp_terrain_get_mesh(p->desc.terrain, node, &mesh) != TERRIMP_OK)
        return 0.0f;
    return p->worth[node] - p->desc.draw_cost -
           p->desc.triangle_cost * (float)(mesh.index_count / 3u);
}

/* Lists the squares whose pictures may serve a cell, and finds out whether they do; returns how
   many they are. */
static uint32_t terrimpi_prepare_squares(const terrimpi_prepare *p, const terrimp_place_picture *at,
                                         const terrimp_box *cell)
{
    uint32_t square, i, count = 0;
    for (square = 0; square < p->squares; square++) {
        uint8_t *serves = p->serves + (size_t)count * p->nodes;
        terrimp_place_picture other;
        terrimp_box box;
        int holds;
        terrimpi_prepare_square(p, square, &other, &box);
        holds = at->x >> other.level == other.x && at->z >> other.level == other.z;
        if (!holds && !p->desc.shafts)
            continue;
        for (i = 0; i < p->nodes; i++)
            serves[i] = p->slots[(size_t)square * p->nodes + i] != TERRIMPI_PLACE_NONE &&
                        (holds || terrimpi_prepare_serves(p, &box, cell, i));
        p->list[count++] = square;
    }
    return count;
}

/* Counts the gains of all pictures, or writes them. */
static void terrimpi_prepare_gains(terrimpi_prepare *p, int write)
{
    uint32_t cell, k, i, n, count, view = 0;
    for (cell = 0; cell < p->cells * p->cells; cell++) {
        terrimp_place_picture at;
        terrimp_box box;
        terrimpi_prepare_square(p, cell, &at, &box);
        terrimpi_prepare_ground(p, &box);
        count = terrimpi_prepare_squares(p, &at, &box);
        for (k = 0; k < p->desc.directions; k++, view++) {
            terrimpi_prepare_worth(p, &box, k);
            if (write)
                p->set->costs[view] = p->worth[p->nodes - 1u];
            for (i = 0; i < p->nodes; i++) {
                float saved = terrimpi_prepare_saved(p, i);
                for (n = 0; saved > 0.0f && n < count; n++) {
                    uint32_t *slot = &p->slots[(size_t)p->list[n] * p->nodes + i];
                    if (!p->serves[(size_t)n * p->nodes + i])
                        continue;
                    if (write) {
                        p->set->gains[*slot].view = view;
                        p->set->gains[*slot].saved = saved;
                    }
                    ++*slot;
                }
            }
        }
    }
}

/* Goes through all pictures: first marks those that can be prepared, then, when their gains have
   been counted, gives those that have any a place. */
static void terrimpi_prepare_pictures(terrimpi_prepare *p, int list)
{
    terrimp_place_set *set = p->set;
    uint32_t i, square;
    set->candidate_count = set->gain_count = 0;
    for (square = 0; square < p->squares; square++) {
        terrimp_place_picture made;
        terrimp_box box;
        terrimpi_prepare_square(p, square, &made, &box);
        for (i = 0; i < p->nodes; i++) {
            uint32_t *slot = &p->slots[(size_t)square * p->nodes + i], count = *slot;
            uint32_t at = set->candidate_count;
            if (!list)
                *slot = terrimpi_prepare_picture(p, &box, i, &made) ? 0u : TERRIMPI_PLACE_NONE;
            if (!list || count == TERRIMPI_PLACE_NONE || count == 0)
                continue;
            if (at < set->candidate_capacity) {
                terrimpi_prepare_picture(p, &box, i, &made);
                made.node = i;
                set->pictures[at] = made;
                set->candidates[at].cluster = i;
                set->candidates[at].first_gain = set->gain_count;
                set->candidates[at].gain_count = count;
                set->candidates[at].memory = (float)made.width * (float)made.height;
            }
            *slot = set->gain_count;
            set->gain_count += count;
            set->candidate_count++;
        }
    }
}

/* Checks a descriptor, fills in its defaults and lays out the scratch memory. */
static terrimp_result terrimpi_prepare_begin(const terrimp_place_terrain_desc *desc, void *base,
                                             terrimpi_prepare *p, size_t *bytes)
{
    terrimpi_arena arena = terrimpi_arena_at(base);
    terrimp_terrain_info info;
    terrimp_place_terrain_desc *d = &p->desc;
    int k;
    TERRIMPI_REFUSE(!desc || !desc->terrain, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimp_terrain_get_info(desc->terrain, &info));
    TERRIMPI_REFUSE(desc->terrain->tree.pages, TERRIMP_E_PAGE);
    *d = *desc;
    TERRIMPI_DEFAULT(d->directions, 8u);
    TERRIMPI_REFUSE(!terrimpi_finite3(d->eyes.min) || !terrimpi_finite3(d->eyes.max) ||
                    !terrimpi_finite2(d->fov_rad, d->pixel_factor) ||
                    !terrimpi_finite2(d->tolerance_px, d->max_angle_rad) ||
                    !terrimpi_finite2(d->draw_cost, d->triangle_cost) ||
                    !terrimpi_finite(d->texels_per_px), TERRIMP_E_NOT_FINITE);
    for (k = 0; k < 3; k++)
        TERRIMPI_REFUSE(d->eyes.min[k] > d->eyes.max[k], TERRIMP_E_RANGE);
    TERRIMPI_REFUSE(d->cell_levels > 6u || d->directions > 64u ||
                    !terrimpi_within(d->fov_rad, 0.01f, 6.3f) || !(d->pixel_factor > 0.0f) ||
                    d->tolerance_px < 0.0f || d->max_angle_rad < 0.0f || d->texels_per_px < 0.0f ||
                    d->draw_cost < 0.0f || d->triangle_cost < 0.0f, TERRIMP_E_RANGE);
    d->tolerance_px = d->tolerance_px > 0.0f ? d->tolerance_px : 1.0f;
    d->max_angle_rad = d->max_angle_rad > 0.0f ? d->max_angle_rad : 0.1f;
    d->texels_per_px = d->texels_per_px > 0.0f ? d->texels_per_px : 1.0f;
    if (!(d->draw_cost > 0.0f) && !(d->triangle_cost > 0.0f)) {
        d->draw_cost = 40.0f;
        d->triangle_cost = 1.0f;
    }
    p->cells = 1u << d->cell_levels;
    p->nodes = info.node_count;
    for (p->squares = 0, k = 0; k <= (int)d->cell_levels; k++)
        p->squares += (p->cells >> k) * (p->cells >> k);
    p->worth = (float *)terrimpi_take(&arena, p->nodes, sizeof *p->worth);
    p->whole = (uint8_t *)terrimpi_take(&arena, p->nodes, 1);
    p->below = (uint8_t *)terrimpi_take(&arena, p->nodes, 1);
    p->list = (uint32_t *)terrimpi_take(&arena, p->squares, sizeof *p->list);
    p->serves = (uint8_t *)terrimpi_take(&arena, terrimpi_mul(p->squares, p->nodes, &arena.ok), 1);
    p->slots = (uint32_t *)terrimpi_take(&arena, terrimpi_mul(p->squares, p->nodes, &arena.ok),
                                         sizeof *p->slots);
    *bytes = arena.bytes;
    return arena.ok ? TERRIMP_OK : TERRIMP_E_OVERFLOW;
}

TERRIMP_API size_t terrimp_place_terrain_scratch_bytes(const terrimp_place_terrain_desc *desc)
{
    terrimpi_prepare p;
    size_t bytes;
    return terrimpi_prepare_begin(desc, NULL, &p, &bytes) == TERRIMP_OK ? bytes : 0;
}

TERRIMP_API terrimp_result terrimp_place_terrain(const terrimp_place_terrain_desc *desc,
                                                 void *scratch, size_t bytes,
                                                 terrimp_place_set *set)
{
    terrimpi_prepare p;
    size_t needed;
    uint32_t i;
    TERRIMPI_REFUSE(!set || !set->candidates || !set->pictures || !set->gains || !set->parents ||
                    !set->costs, TERRIMP_E_NULL);
    TERRIMPI_TRY(terrimpi_prepare_begin(desc, scratch, &p, &needed));
    TERRIMPI_TRY(terrimpi_check_block(scratch, bytes, needed));
    p.set = set;
    set->cluster_count = p.nodes;
    set->view_count = p.cells * p.cells * p.desc.directions;
    terrimpi_prepare_pictures(&p, 0);
    terrimpi_prepare_gains(&p, 0);
    terrimpi_prepare_pictures(&p, 1);
    TERRIMPI_REFUSE(set->candidate_count > set->candidate_capacity ||
                    set->gain_count > set->gain_capacity ||
                    set->cluster_count > set->cluster_capacity ||
                    set->view_count > set->view_capacity, TERRIMP_E_CAPACITY);
    terrimpi_prepare_gains(&p, 1);
    for (i = 0; i < p.nodes; i++)
        set->parents[i] = i + 1u == p.nodes
                              ? i : terrimpi_tree_parent_number(&p.desc.terrain->tree, i);
    return TERRIMP_OK;
}

#endif /* TERRIMP_NO_BUILD */

#ifdef __cplusplus
}
#endif

#endif /* TERRIMP_IMPLEMENTATION_ONCE */
#endif /* TERRIMP_IMPLEMENTATION */

/* VERSION HISTORY
   0.5.0  all terrain lies at its own depth: depth_bias and the alpha of ground are gone, impostors
          have an alpha, the share of the pixels in the fade band; texture matrices and
          terrimp_texture_coordinates take positions relative to the eye of the picture;
          exact_depth, endless, cost_limit and bound, asked for by functions of their own, so that
          others do not link what they need; terrimp_view_set; a hider, which hides what lies behind
          ridges; statistics are counted when they are asked for; first what draws, then what
          builds. New rooms: Quadtree, Visibility, Sorted, Layers, Placement. Gone: the pair of
          atlases (a benchmark has it), evict, query, rect, reset and room of the live atlas, fitted
          heights, stitched patterns, upper_skirts, TERRIMP_NO_BOUND, terrimp_capture_rate,
          terrimp_heightfield_sample
   0.4.1  no ray slips through the surface whatever the registers' width; TERRIMP_STATIC without
          warnings of what is not called, -O3 without any
   0.4.0  skirts no deeper than neighbours need, upper ones when asked for: upper_skirts instead of
          no_upper_skirts; the fade band of AUTO is narrower; three options that small machines may
          leave out: TERRIMP_NO_SPLIT, TERRIMP_NO_BOUND, TERRIMP_NO_MORPH
   0.3.0  in mode AUTO the tolerance rules sharpness, view angle and fade; captures that are too
          large for a frame are made in pieces; terrimp_capture_split counts what comes into sight,
          and takes how far the eye moves and how far the parts overlap. Gone, as others do the
          same: terrimp_skirt_counts, terrimp_border_corner_raise, terrimp_terrain_fill_weights
   0.2.0  a quadtree of ground and impostors, one cost model that chooses, a live atlas, a schedule
          that looks ahead, pictures in pieces and in two parts, edits, bakes, building without
          memory of one's own, ground that morphs and whose coarse levels may be fitted
   0.1.0  terrain impostors end to end: heightfield, simplifier, fitted frustum, picture size,
          texture matrix, update criteria, two atlases, fade band, floor, height queries;
          geometrical mipmapping on its own

   LICENCE (MIT)
   Copyright (c) 2026 the terrimp authors

   Permission is hereby granted, free of charge, to any person obtaining a copy of this software and
   associated documentation files (the "Software"), to deal in the Software without restriction,
   including without limitation the rights to use, copy, modify, merge, publish, distribute,
   sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is
   furnished to do so, subject to the following conditions:

   The above copyright notice and this permission notice shall be included in all copies or
   substantial portions of the Software.

   THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT
   NOT LIMITED TO THE WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND
   NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM,
   DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR OTHERWISE, ARISING FROM,
   OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE. */
