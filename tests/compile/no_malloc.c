/* Without malloc: the create functions are gone, and a call of malloc would not compile. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define malloc(bytes) there_is_no_malloc
#define free(pointer) there_is_no_malloc

#define TERRIMP_NO_MALLOC
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#include "use.h"

int main(void)
{
    return use_terrimp();
}
