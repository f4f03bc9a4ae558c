# terrimp.h needs no building; this builds its examples, tests and benchmarks.

## make           builds the examples into build/; make NAME builds one program
## make deps      installs what is missing, on Debian: a compiler, libpng, OpenGL without a window
## make demo      flies over a terrain: pictures and a table of statistics, in build/demo/
##                  DEM=FILE     over this elevation file instead of a made-up terrain
##                  ARGS='...'   more options for build/flyover
## make deps-viewer viewer   a window to fly in, build/viewer [FILE]; needs GLFW
## make deps-web web   the same as a page: build/web/, for any static server; needs Emscripten
## make test      runs every test, as many suites at once as there are cores
##                  JOBS=N   so many at once; 1: one after the other
## make bench     measures; tables and plots also go to build/bench/
##                  BENCH_FRAMES=N   frames of a flight; BENCH_ONLY=NAME: of one scene
##                  BENCH_ALL=1      the whole protocol, for hours
## make figures   takes what bench left over into README.md and tests/results
## make scene-table   measures what stands around the terrain: tests/results/scene.md
## make check-portable   every compiler, other machines under an emulator, no operating system
## make sizes     bytes of code for small machines
## make fuzz SECONDS=60   looks for input that breaks the library, so long for each fuzzer
## make coverage  which lines and branches the unit tests reach
## make analyse   static analysis and valgrind
## make deps-portable    installs what these five use, on Debian
## make golden    writes tests/golden.h anew, where what hosts get is meant to change
## make clean     removes build/
##
## With any of them: CC=clang, CFLAGS='...', CONFIG=release|debug|sanitize|coverage, and
## GL=osmesa|egl, which windowless OpenGL; without it OSMesa where its header is, else EGL.

CONFIG ?= release

# The C++ compiler that belongs to the C compiler, unless CXX is given.
ifeq ($(origin CXX),default)
CXX := $(subst clang,clang++,$(subst gcc,g++,$(patsubst cc,c++,$(CC))))
endif

# What is asked for by name builds into a folder of its own, e.g. build/debug/egl.
BUILD := build$(addprefix /,$(filter-out release,$(CONFIG)))$(addprefix /,$(GL))

CONFIG_release  := -O2
CONFIG_debug    := -O0 -g
CONFIG_sanitize := -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all
CONFIG_coverage := -O0 -g --coverage
ifndef CONFIG_$(CONFIG)
$(error CONFIG is release, debug, sanitize or coverage, not "$(CONFIG)")
endif

WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wdouble-promotion \
            -Wcast-qual -Wundef -Wvla -Wstrict-prototypes -Wmissing-prototypes
CXX_WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion \
                -Wdouble-promotion -Wcast-qual -Wundef -Wvla

# The compiler is asked as late as a recipe runs, so that `make deps demo` sees what deps installed.
has_header = $(shell $(CC) -E -include $(1) -x c /dev/null >/dev/null 2>&1 && echo yes)
GL ?= $(if $(call has_header,GL/osmesa.h),osmesa,egl)
GL_FLAGS_osmesa := -DHOST_OSMESA
GL_LIBS_osmesa  := -lOSMesa
GL_FLAGS_egl    := -DHOST_EGL
GL_LIBS_egl     := -lEGL -lOpenGL
GL_LIBS          = $(GL_LIBS_$(GL))

# The benchmark compares with meshoptimizer where that is installed.
BENCH_FLAGS = $(if $(call has_header,meshoptimizer.h),-DTERRIMP_HAVE_MESHOPT)
BENCH_LIBS  = $(if $(call has_header,meshoptimizer.h),-lmeshoptimizer)

# GeoTIFF is read where libtiff is installed.
TIFF_FLAGS = $(if $(call has_header,tiffio.h),-DHOST_TIFF)
TIFF_LIBS  = $(if $(call has_header,tiffio.h),-ltiff)

# The viewer needs GLFW, and is built when it is asked for.
EXAMPLES := $(filter-out viewer,$(patsubst examples/%.c,%,$(wildcard examples/*.c)))
EXAMPLES_CPP := $(patsubst examples/%.cpp,%,$(wildcard examples/*.cpp))
BENCHES  := $(patsubst tests/%.c,%,$(wildcard tests/bench_*.c))
TESTS    := unit flights unit_host render
HOST     := $(patsubst examples/%.c,$(BUILD)/%.o,$(wildcard examples/host/*.c))
DEPS     := $(filter deps deps-portable deps-viewer deps-web,$(MAKECMDGOALS))

all: $(EXAMPLES) $(if $(shell command -v $(firstword $(CXX))),$(EXAMPLES_CPP))

$(EXAMPLES) $(EXAMPLES_CPP) $(BENCHES) $(TESTS) viewer test_viewer compare_pictures: %: $(BUILD)/%

help:
	@sed -n 's/^## \{0,1\}//p' Makefile

deps:
	@sh tests/deps.sh

deps-viewer:
	@sh tests/deps_viewer.sh

test-viewer: | $(DEPS)
	@sh tests/viewer.sh

deps-web:
	@sh tests/deps_viewer.sh web

test-web: | $(DEPS)
	@sh tests/web.sh

# The viewer as a page: what it uses of examples/host, without threads and libraries.
WEB_HOST := dem dem_png dem_text dem_tiff flight frame gl_terrain hud image job lightmap options \
            procedural sea stats tour trees walker
web: build/web/viewer.js build/web/index.html

build/web/index.html: examples/viewer.html
	@mkdir -p $(@D) && cp $< $@

build/web/viewer.js: examples/viewer.c $(WEB_HOST:%=examples/host/%.c) examples/viewer_web.h \
                     $(wildcard examples/host/*.h) terrimp.h | $(DEPS)
	@mkdir -p $(@D)
	@echo "compile $@"
	@NODE_PATH=/usr/share/nodejs emcc -std=c99 -O2 -I. -DHOST_NO_THREADS -DHOST_NO_PNG \
	    $(filter %.c,$^) -sUSE_GLFW=3 -sMIN_WEBGL_VERSION=2 -sMAX_WEBGL_VERSION=2 \
	    -sALLOW_MEMORY_GROWTH -sENVIRONMENT=web -sEXPORTED_RUNTIME_METHODS=ccall,FS -o $@

demo: flyover
	@mkdir -p build/demo
	$(BUILD)/flyover --compare --frames 150 --save-every 30 --out build/demo \
	    --stats build/demo/statistics.tsv $(addprefix --dem ,$(DEM)) $(ARGS)
	@echo "Pictures: build/demo/*.png   Statistics, a line a frame: build/demo/statistics.tsv"

test: | $(DEPS)
	@sh tests/run.sh

bench: $(BENCHES) town prepared $(patsubst %.c,build/bench/%.hgt,$(notdir $(wildcard ../shared/tools/rough.c)))
	@for name in $(BENCHES); do \
	    start=$$(date +%s); echo; echo "---- $$name"; $(BUILD)/$$name || exit 1; \
	    echo "---- $$name took $$(($$(date +%s) - start)) s"; \
	done

figures:
	@sh tests/figures.sh

scene-table:
	@MAKE='$(MAKE)' sh tests/scene.sh

# The rough terrain on which other engines have been measured.
build/bench/rough.hgt: ../shared/tools/rough.c
	@mkdir -p $(@D)
	@$(CC) -O2 $< -o build/bench/rough -lm && build/bench/rough 2049 $@

deps-portable:
	@sh tests/deps_portable.sh

check-portable sizes coverage analyse: | $(DEPS)
	@sh tests/$(subst check-,,$@).sh

SECONDS ?= 60
fuzz: | $(DEPS)
	@sh tests/fuzz.sh $(SECONDS)

# Into a file beside it first: the program that prints the new values has the old ones in it.
golden: flights
	@$(BUILD)/flights golden > $(BUILD)/golden.h && cp $(BUILD)/golden.h tests/golden.h
	@git --no-pager diff --stat tests/golden.h

clean:
	rm -rf build

# Every program is one source file of examples/ or tests/, and what it uses of examples/host/.
vpath %.c examples tests
vpath %.cpp examples

$(BUILD)/%: $(BUILD)/%.o $(BUILD)/host.a
	@echo "link    $@"
	@$(LINK) $(CONFIG_$(CONFIG)) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) $(GL_LIBS) $(TIFF_LIBS) -lpng -lm \
	    -o $@

$(BUILD)/host.a: $(HOST)
	@rm -f $@
	@ar rc $@ $^

$(BUILD)/%.o: %.c | $(DEPS)
	@mkdir -p $(@D)
	@echo "compile $<"
	@$(CC) -std=c99 $(WARNINGS) $(CONFIG_$(CONFIG)) $(GL_FLAGS_$(GL)) $(FLAGS) -I. -MMD -MP \
	    $(CFLAGS) -c $< -o $@

$(BUILD)/%.o: %.cpp | $(DEPS)
	@mkdir -p $(@D)
	@echo "compile $<"
	@$(CXX) -std=c++11 -pthread $(CXX_WARNINGS) $(CONFIG_$(CONFIG)) $(FLAGS) -I. -MMD -MP \
	    $(CXXFLAGS) -c $< -o $@

$(BUILD)/host/dem_tiff.o $(BUILD)/unit_host.o: FLAGS = $(TIFF_FLAGS)

LINK = $(CC)
$(EXAMPLES_CPP:%=$(BUILD)/%): LINK = $(CXX) -pthread

$(BUILD)/bench_%: FLAGS = $(BENCH_FLAGS)
$(BUILD)/bench_%: LIBS = $(BENCH_LIBS) -pthread
$(BUILD)/parallel_build $(BUILD)/pages $(BUILD)/stream: LIBS = -lpthread
$(BUILD)/viewer $(BUILD)/test_viewer: LIBS = -lpthread
$(BUILD)/viewer $(BUILD)/test_viewer: GL_LIBS = -lglfw -lGL

-include $(wildcard $(BUILD)/*.d $(BUILD)/*/*.d)

.PHONY: all help deps demo test bench figures scene-table clean deps-portable check-portable sizes coverage analyse fuzz golden \
        $(EXAMPLES) $(EXAMPLES_CPP) $(BENCHES) $(TESTS) viewer test_viewer compare_pictures test-viewer deps-viewer web \
        deps-web test-web
.SECONDARY:
