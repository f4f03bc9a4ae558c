/* Two files with a private copy of the library each. */
#define TERRIMP_STATIC
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"
#include "unit_b.h"

int main(void)
{
    return use_terrimp() || use_terrimp_in_b();
}
