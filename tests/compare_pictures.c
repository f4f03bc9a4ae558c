/* Prints the PSNR of two PNG files of one size [dB]; 99 when they are equal. */
#include "examples/host/image.h"

#include <stdio.h>

int main(int argc, char **argv)
{
    uint8_t *a, *b;
    int width[2], height[2];
    if (argc != 3 || image_read_png(argv[1], &a, &width[0], &height[0])
        || image_read_png(argv[2], &b, &width[1], &height[1]) || width[0] != width[1]
        || height[0] != height[1])
        return fprintf(stderr, "two PNG files of one size are wanted\n"), 2;
    printf("%.2f\n", image_psnr(image_mean_square(a, b, (size_t)width[0] * (size_t)height[0],
                                                  NULL)));
    return 0;
}
