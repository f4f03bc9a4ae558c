/* What other engines reached on the same two flights, all 120 frames, measured once on one machine
   with the same rasteriser: quoted here, not measured. */
#ifndef BENCH_PEERS_H
#define BENCH_PEERS_H

typedef struct peer {
    const char *scene, *name;
    double ratio;      /* of its time to the full mesh's */
    double psnr;       /* over terrain, against its own full resolution [dB] */
    double triangles, draws;
} peer;

static const peer peers[] = {
    { "pyrenees", "OGRE Terrain, 1 px", 0.84, 47.7, 1014000, 152 },
    { "pyrenees", "OGRE Terrain, 3 px", 0.54, 38.2, 437000, 101 },
    { "pyrenees", "OGRE Terrain, 8 px", 0.31, 31.4, 154000, 40 },
    { "pyrenees", "Irrlicht, 128/256/512 cells", 0.24, 33.0, 84000, 1 },
    { "pyrenees", "Irrlicht, defaults", 0.13, 27.0, 24000, 1 },
    { "pyrenees", "Irrlicht, patch 65", 0.20, 29.8, 63000, 1 },
    { "pyrenees", "osgSim::Impostor per chunk", 0.73, 33.6, 106000, 140 },
    { "rough", "OGRE Terrain, 1 px", 0.51, 34.5, 1411000, 397 },
    { "rough", "OGRE Terrain, 3 px", 0.145, 26.9, 197000, 82 },
    { "rough", "OGRE Terrain, 8 px", 0.063, 22.3, 41000, 17 },
    { "rough", "Irrlicht, 128/256/512 cells", 0.090, 26.1, 96000, 1 },
    { "rough", "Irrlicht, defaults", 0.081, 24.8, 80000, 1 },
    { "rough", "Irrlicht, patch 65", 0.035, 20.6, 12000, 1 },
    { "rough", "osgSim::Impostor per chunk", 0.37, 21.1, 61000, 500 }
};
#define PEER_COUNT (sizeof peers / sizeof *peers)

#endif
