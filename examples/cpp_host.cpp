/* Shows a host in C++: the header compiled as C++, its objects in unique_ptr, its results turned
   into exceptions, and its commands recorded. A command is plain values, so a list of copies is all
   that a render thread needs: here frame n + 1 is decided and recorded while frame n is drawn.
   Build:  make cpp_host
   Expect: 40 frames of a flight, some of them compared with the full mesh; the last one in
           build/cpp_host.png. Exit code 1 when one has holes or is too far from the full mesh. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
extern "C" {
#include "host/context.h"
#include "host/gl_terrain.h"
#include "host/image.h"
#include "host/scene.h"
}

#include <cmath>
#include <cstdio>
#include <future>
#include <memory>
#include <stdexcept>
#include <unordered_map>
#include <vector>

namespace {

constexpr int width = 640, height = 480;
constexpr uint32_t atlas_size = 2048;

void check(terrimp_result result)
{
    if (result != TERRIMP_OK)
        throw std::runtime_error(terrimp_result_text(result));
}

void check(const char *trouble)
{
    if (trouble)
        throw std::runtime_error(trouble);
}

struct Destroy {
    void operator()(terrimp_terrain *terrain) const { terrimp_terrain_destroy(terrain); }
    void operator()(terrimp_view *view) const { terrimp_view_destroy(view); }
};
using Terrain = std::unique_ptr<terrimp_terrain, Destroy>;
using View = std::unique_ptr<terrimp_view, Destroy>;

Terrain make_terrain(const terrimp_terrain_desc &desc)
{
    terrimp_terrain *terrain = nullptr;
    check(terrimp_terrain_create(&desc, nullptr, &terrain));
    return Terrain(terrain);
}

View make_view(const Terrain &terrain, int mode)
{
    terrimp_view_desc desc{};
    terrimp_view *view = nullptr;
    desc.mode = mode;
    desc.atlas_size = atlas_size;
    desc.exact_depth = terrimp_view_exact_depth();
    check(terrimp_view_create(terrain.get(), &desc, nullptr, &view));
    return View(view);
}

/* ---- The commands of a frame -------------------------------------------- */

struct Command {
    enum Kind { begin_capture, end_capture, impostor, ground, floor } kind;
    union {
        terrimp_capture_command capture;
        terrimp_impostor_command mesh;
        terrimp_ground_command node;
        terrimp_floor_command below;
    };
};

struct Frame {
    terrimp_camera camera{};
    terrimp_stats stats{};
    std::vector<Command> commands;
};

template <Command::Kind kind, typename T, T Command::*member>
void append(void *frame, const T *command)
{
    Command copy{};
    copy.kind = kind;
    copy.*member = *command;
    static_cast<Frame *>(frame)->commands.push_back(copy);
}

/* Touches nothing but the view: any thread may do it. */
Frame record(terrimp_view *view, const terrimp_camera &camera)
{
    Frame frame;
    terrimp_callbacks callbacks{};
    callbacks.user = &frame;
    callbacks.begin_capture =
        append<Command::begin_capture, terrimp_capture_command, &Command::capture>;
    callbacks.end_capture =
        append<Command::end_capture, terrimp_capture_command, &Command::capture>;
    callbacks.draw_impostor = append<Command::impostor, terrimp_impostor_command, &Command::mesh>;
    callbacks.draw_ground = append<Command::ground, terrimp_ground_command, &Command::node>;
    callbacks.draw_floor = append<Command::floor, terrimp_floor_command, &Command::below>;
    frame.camera = camera;
    check(terrimp_view_update(view, &camera));
    check(terrimp_view_get_stats(view, &frame.stats));
    check(terrimp_view_render(view, &callbacks));
    return frame;
}

/* ---- OpenGL ------------------------------------------------------------- */

/* One program draws everything: ground wears the lightmap, impostors the atlas, both through a
   texture matrix. Pictures hold colours times alpha, hence the division; of a picture in two parts
   each shows only what lies within its own depth. What fades in shows on the pixels whose
   threshold lies below its alpha. An impostor's depth is that of the terrain in its picture, or of
   its mesh where that is farther: see place_matrix in terrimp_impostor_command. */
const float world_origin[3] = {};
const char vertex_source[] =
    "#version 330 core\n"
    "in vec3 position;\n"
    "uniform mat4 view, projection, texture_matrix;\n"
    "uniform vec3 eye, picture_eye;\n"
    "out vec4 strq;\n"
    "void main() {\n"
    "    strq = texture_matrix * vec4(position - picture_eye, 1.0);\n"
    "    gl_Position = projection * vec4(mat3(view) * (position - eye), 1.0);\n"
    "}\n";
const char fragment_source[] =
    "#version 330 core\n"
    "uniform sampler2D picture, depths;\n"
    "uniform mat4 view, projection, place_matrix;\n"
    "uniform float alpha;\n"
    "uniform bool impostor, part;\n"
    "in vec4 strq;\n"
    "out vec4 colour;\n"
    "void main() {\n"
    "    float threshold = fract(dot(floor(gl_FragCoord.xy), vec2(0.754877666, 0.569840291)));\n"
    "    if (threshold >= alpha) discard;\n"
    "    if (part && (strq.z < 0.0 || strq.z > strq.w)) discard;\n"
    "    vec4 c = textureProj(picture, strq);\n"
    "    if (c.a < 0.5) discard;\n"
    "    colour = vec4(c.rgb / c.a, 1.0);\n"
    "    gl_FragDepth = gl_FragCoord.z;\n"
    "    if (impostor) {\n"
    "        vec2 st = strq.xy / strq.w;\n"
    "        vec4 at = place_matrix * vec4(st, texture(depths, st).r, 1.0);\n"
    "        at = projection * vec4(mat3(view) * at.xyz, at.w);\n"
    "        gl_FragDepth = max(gl_FragCoord.z, 0.5 * at.z / at.w + 0.5);\n"
    "    }\n"
    "}\n";

GLuint make_texture(uint32_t size, GLint kept, GLenum format, GLenum type, const uint8_t *texels,
                    GLint smaller)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, smaller);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTexImage2D(GL_TEXTURE_2D, 0, kept, GLsizei(size), GLsizei(size), 0, format, type, texels);
    return texture;
}

class Renderer {
public:
    Renderer(const terrimp_terrain *terrain, const scene &shown);
    ~Renderer() { context_close(&context_); }
    Renderer(const Renderer &) = delete;
    Renderer &operator=(const Renderer &) = delete;
    std::vector<uint8_t> draw(const Frame &frame);
    std::vector<float> distances(const Frame &frame);

private:
    GLuint vertices_of(uint32_t node);
    GLuint make_array(const std::vector<float> &xyz, GLuint indices);
    void set_camera(const float view[16], const float projection[16], const float eye[3]);
    void turn_to_screen(const terrimp_camera &camera, float z_far);
    void begin_capture(const terrimp_capture_command &c);
    void draw_range(GLuint array, uint32_t base_vertex, uint32_t first_index, uint32_t index_count,
                    GLuint texture, const float *texture_matrix, const float *picture_eye,
                    float alpha);
    GLint uniform(const char *name) const { return glGetUniformLocation(program_, name); }

    const terrimp_terrain *terrain_;
    terrimp_terrain_info info_{};
    context context_{};
    GLuint program_ = 0, ground_indices_ = 0, meshes_ = 0, lightmap_ = 0;
    GLuint atlas_ = 0, atlas_frame_ = 0;
    const float *lightmap_matrix_;
    std::unordered_map<uint32_t, GLuint> nodes_; // vertex arrays of what was drawn so far
    bool capturing_ = false, on_screen_ = false;
};

GLuint make_buffer(GLenum target, const void *data, size_t bytes)
{
    GLuint buffer;
    glGenBuffers(1, &buffer);
    glBindBuffer(target, buffer);
    glBufferData(target, GLsizeiptr(bytes), data, GL_STATIC_DRAW);
    return buffer;
}

GLuint Renderer::make_array(const std::vector<float> &xyz, GLuint indices)
{
    GLuint array;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    make_buffer(GL_ARRAY_BUFFER, xyz.data(), xyz.size() * sizeof(float));
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices);
    glEnableVertexAttribArray(0);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    return array;
}

Renderer::Renderer(const terrimp_terrain *terrain, const scene &shown)
    : terrain_(terrain), lightmap_matrix_(shown.lightmap_matrix)
{
    check(context_open(&context_, width, height));
    check(terrimp_terrain_get_info(terrain, &info_));
    program_ = gl_program_make(vertex_source, fragment_source).id;
    check(program_ ? nullptr : "the shaders do not compile");
    glUseProgram(program_);

    std::vector<uint16_t> indices(info_.ground_index_count);
    check(terrimp_terrain_fill_indices(terrain, indices.data(), indices.size()));
    ground_indices_ = make_buffer(GL_ARRAY_BUFFER, indices.data(), indices.size() * 2);

    std::vector<float> xyz(size_t(info_.mesh_vertex_count) * 3);
    indices.resize(info_.mesh_index_count);
    check(terrimp_terrain_fill_meshes(terrain, xyz.data(), xyz.size(), indices.data(),
                                      indices.size()));
    meshes_ = make_array(xyz, make_buffer(GL_ARRAY_BUFFER, indices.data(), indices.size() * 2));

    lightmap_ = make_texture(SCENE_SIDE, GL_RGBA8, GL_RGB, GL_UNSIGNED_BYTE, shown.lightmap,
                             GL_LINEAR_MIPMAP_LINEAR);
    glGenerateMipmap(GL_TEXTURE_2D);

    GLuint depth = make_texture(atlas_size, GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT,
                                GL_UNSIGNED_INT, nullptr, GL_LINEAR);
    atlas_ = make_texture(atlas_size, GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, nullptr, GL_LINEAR);
    glGenFramebuffers(1, &atlas_frame_);
    glBindFramebuffer(GL_FRAMEBUFFER, atlas_frame_);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, atlas_, 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth, 0);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, depth);
    glActiveTexture(GL_TEXTURE0);
    glUniform1i(uniform("depths"), 1);
    glEnable(GL_DEPTH_TEST);
    glEnable(GL_CULL_FACE);
    glEnable(GL_SCISSOR_TEST);
}

GLuint Renderer::vertices_of(uint32_t node)
{
    GLuint &array = nodes_[node];
    if (!array) {
        std::vector<float> xyz(size_t(info_.ground_vertex_count) * 3);
        check(terrimp_terrain_fill_ground(terrain_, node, xyz.data(), xyz.size()));
        array = make_array(xyz, ground_indices_);
    }
    return array;
}

void Renderer::set_camera(const float view[16], const float projection[16], const float eye[3])
{
    glUniformMatrix4fv(uniform("view"), 1, GL_FALSE, view);
    glUniformMatrix4fv(uniform("projection"), 1, GL_FALSE, projection);
    glUniform3fv(uniform("eye"), 1, eye);
}

void Renderer::begin_capture(const terrimp_capture_command &c)
{
    const GLint x = GLint(c.slot.x), y = GLint(c.slot.y);
    glBindFramebuffer(GL_FRAMEBUFFER, atlas_frame_);
    glViewport(x, y, GLsizei(c.slot.width), GLsizei(c.slot.height));
    glScissor(x, y, GLsizei(c.slot.width), GLsizei(c.slot.height));
    glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
    if (c.clear)
        glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    set_camera(c.view, c.projection, c.eye);
    on_screen_ = false;
    capturing_ = true;
}

void Renderer::turn_to_screen(const terrimp_camera &camera, float z_far)
{
    float view[16], projection[16];
    terrimp_camera deep = camera;
    if (on_screen_ || capturing_)
        return;
    on_screen_ = true;
    deep.z_far = z_far;
    check(terrimp_camera_matrices(&deep, view, projection));
    context_bind(&context_);
    glScissor(0, 0, width, height);
    glClearColor(float(scene_sky[0]) / 255.0f, float(scene_sky[1]) / 255.0f,
                 float(scene_sky[2]) / 255.0f, 1.0f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    set_camera(view, projection, camera.eye);
}

void Renderer::draw_range(GLuint array, uint32_t base_vertex, uint32_t first_index,
                          uint32_t index_count, GLuint texture, const float *texture_matrix,
                          const float *picture_eye, float alpha)
{
    glBindVertexArray(array);
    glBindTexture(GL_TEXTURE_2D, texture);
    glUniformMatrix4fv(uniform("texture_matrix"), 1, GL_FALSE, texture_matrix);
    glUniform3fv(uniform("picture_eye"), 1, picture_eye);
    glUniform1f(uniform("alpha"), alpha);
    glDrawElementsBaseVertex(GL_TRIANGLES, GLsizei(index_count), GL_UNSIGNED_SHORT,
                             reinterpret_cast<const void *>(size_t(first_index) * 2),
                             GLint(base_vertex));
}

std::vector<uint8_t> Renderer::draw(const Frame &frame)
{
    std::vector<uint8_t> rgb(size_t(width) * height * 3);
    on_screen_ = false;
    for (const Command &c : frame.commands) {
        if (c.kind == Command::begin_capture) {
            begin_capture(c.capture);
            continue;
        }
        if (c.kind == Command::end_capture) {
            capturing_ = false;
            continue;
        }
        turn_to_screen(frame.camera, frame.stats.z_far);
        glUniform1i(uniform("impostor"), c.kind == Command::impostor);
        glUniform1i(uniform("part"), c.kind == Command::impostor && c.mesh.part_count > 1);
        if (c.kind == Command::impostor)
            glUniformMatrix4fv(uniform("place_matrix"), 1, GL_FALSE, c.mesh.place_matrix);
        (c.kind == Command::impostor ? glDisable : glEnable)(GL_CULL_FACE);
        if (c.kind == Command::impostor)
            draw_range(meshes_, c.mesh.base_vertex, c.mesh.first_index, c.mesh.index_count,
                       atlas_, c.mesh.texture_matrix, c.mesh.eye, c.mesh.alpha);
        else if (c.kind == Command::floor)
            draw_range(meshes_, c.below.base_vertex, c.below.first_index, c.below.index_count,
                       lightmap_, lightmap_matrix_, world_origin, 1.0f);
        else
            draw_range(vertices_of(c.node.node), 0, c.node.first_index, c.node.index_count,
                       lightmap_, lightmap_matrix_, world_origin, 1.0f);
    }
    turn_to_screen(frame.camera, frame.stats.z_far); // also when there is nothing to draw
    context_read(&context_, rgb.data());
    return rgb;
}

/* How far along forward the last frame's pixels lie, by their depth. */
std::vector<float> Renderer::distances(const Frame &frame)
{
    const float front = frame.camera.z_near, back = frame.stats.z_far;
    std::vector<float> depth(size_t(width) * height);
    glReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
    for (float &d : depth)
        d = front * back / (back - d * (back - front));
    return depth;
}

/* ---- A terrain and a flight --------------------------------------------- */

struct Scene : scene {
    Scene() { check(scene_open(this)); }
    ~Scene() { scene_close(this); }
    Scene(const Scene &) = delete;
    Scene &operator=(const Scene &) = delete;
};

bool fly(const char *program)
{
    Scene shown;
    const Terrain terrain = make_terrain(shown.desc);
    const View view = make_view(terrain, TERRIMP_MODE_DEFAULT);
    const View yardstick = make_view(terrain, TERRIMP_MODE_FULL);
    Renderer renderer(terrain.get(), shown);
    std::vector<uint8_t> rgb;
    Frame frame = record(view.get(), scene_camera(0, width, height));
    size_t pixels = 0, off = 0; // of terrain; those whose depth is off by 1 % of the distance
    for (int i = 0; i < SCENE_FRAMES; i++) {
        std::future<Frame> next = std::async(std::launch::async, record, view.get(),
                                             scene_camera(i + 1, width, height));
        rgb = renderer.draw(frame);
        if (scene_judges(i)) {
            const auto ours = renderer.distances(frame);
            const Frame truth = record(yardstick.get(), frame.camera);
            const auto full = renderer.draw(truth);
            const auto there = renderer.distances(truth);
            for (size_t k = 0; k < there.size(); k++) {
                const bool seen = there[k] < 0.999f * truth.stats.z_far;
                pixels += seen;
                off += seen && std::fabs(ours[k] - there[k]) > 0.01f * there[k];
            }
            scene_judge(&shown, i, &frame.stats, rgb.data(), full.data(), width, height);
        }
        frame = next.get();
    }
    check(image_write_beside(program, "cpp_host.png", rgb.data(), width, height));
    check(glGetError() == GL_NO_ERROR ? nullptr : "OpenGL reports an error");
    std::printf("depth off by more than 1 %% of the distance: %.2f %% of the pixels\n",
                100.0 * double(off) / double(pixels));
    return scene_accepts(&shown, 37.0) && off * 100 < pixels;
}

} // namespace

int main(int argc, char **argv)
{
    (void)argc;
    try {
        return fly(argv[0]) ? 0 : 1;
    } catch (const std::exception &trouble) {
        std::fprintf(stderr, "cpp_host: %s\n", trouble.what());
        return 2;
    }
}
