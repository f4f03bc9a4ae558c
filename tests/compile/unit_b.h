#ifndef UNIT_B_H
#define UNIT_B_H

/* 0 when the library works from unit_b.c. */
int use_terrimp_in_b(void);

#endif
