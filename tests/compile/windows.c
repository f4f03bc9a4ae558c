/* After the macros of windows.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define near
#define far
#define NEAR near
#define FAR far
#define IN
#define OUT
#define CONST const
#define small char
#define interface struct
#define min(a, b) (((a) < (b)) ? (a) : (b))
#define max(a, b) (((a) > (b)) ? (a) : (b))

#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

int main(void)
{
    return use_terrimp();
}
