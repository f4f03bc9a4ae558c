/* The library as the programs of unit tests have it. Every allocation is counted: what says it
   allocates nothing is held to it. */
#ifndef UNIT_LIBRARY_H
#define UNIT_LIBRARY_H

#include <stdlib.h>

static size_t unit_allocations;

static void *unit_malloc(size_t bytes)
{
    unit_allocations++;
    return malloc(bytes);
}

#define TERRIMP_MALLOC(bytes) unit_malloc(bytes)
#define TERRIMP_FREE(pointer) free(pointer)
#define TERRIMP_IMPLEMENTATION
#include "terrimp.h"

#endif
