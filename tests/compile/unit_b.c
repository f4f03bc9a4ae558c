#include "terrimp.h"

#include "use.h"
#include "unit_b.h"

int use_terrimp_in_b(void)
{
    return use_terrimp();
}
