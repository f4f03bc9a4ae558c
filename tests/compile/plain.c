/* The ordinary use: one file has the implementation. */
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

int main(void)
{
    return use_terrimp();
}
