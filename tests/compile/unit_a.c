/* Two files of one program: this one has the implementation, unit_b.c uses it. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"
#include "unit_b.h"

int main(void)
{
    return use_terrimp() || use_terrimp_in_b();
}
