/* Included again and again, before and after and while TERRIMP_IMPLEMENTATION is defined. */
#include "terrimp.h"
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#include "terrimp.h"
#undef TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

int main(void)
{
    return use_terrimp();
}
