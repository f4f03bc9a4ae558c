/* The frame of a context, whoever made it: context.c without a window, or a program with one. */
#include "context.h"

#include <stddef.h>

void context_bind(const context *c)
{
    glBindFramebuffer(GL_FRAMEBUFFER, c->framebuffer);
    glViewport(0, 0, c->width, c->height);
}

void context_read(const context *c, uint8_t *rgb)
{
    int row, column;
    glBindFramebuffer(GL_FRAMEBUFFER, c->framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glReadPixels(0, 0, c->width, c->height, GL_RGBA, GL_UNSIGNED_BYTE, c->reading);
    for (row = 0; row < c->height; row++) { /* OpenGL's first row is the bottom one */
        const uint8_t *from = c->reading + (size_t)(c->height - 1 - row) * (size_t)c->width * 4u;
        for (column = 0; column < c->width; column++, from += 4, rgb += 3) {
            rgb[0] = from[0];
            rgb[1] = from[1];
            rgb[2] = from[2];
        }
    }
}
