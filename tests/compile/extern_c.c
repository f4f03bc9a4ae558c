/* Some programs include every C header inside extern "C". */
#ifdef __cplusplus
extern "C" {
#endif
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"
#ifdef __cplusplus
}
#endif

#include "use.h"

int main(void)
{
    return use_terrimp();
}
