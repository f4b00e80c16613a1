# rt: a Lua-scripted ray tracer. `make help` lists what there is.
#   BUILD=release|debug|asan|tsan  picks flags and object folder; the release program is ./rt, others build/$(BUILD)/rt
#   CC=gcc|clang  OPT=-O3  WERROR=1  V=1  JOBS=2  PREFIX=/usr/local

ifeq ($(origin CC),default)
CC = gcc
endif
BUILD ?= release
OPT ?= -O3
PREFIX ?= /usr/local
JOBS ?= $(shell nproc)
ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(JOBS)
endif

OUT := build/$(BUILD)$(if $(filter gcc,$(CC)),,-$(notdir $(CC)))
PROGRAM := $(if $(filter build/release,$(OUT)),rt,$(OUT)/rt)

# What the build types add. Release builds leave assertions out, the three others keep them.
# Under sanitizers gcc takes variables for uninitialized that are not.
UNINITIALIZED := $(if $(findstring clang,$(CC)),,-Wno-maybe-uninitialized)
FLAGS_release := $(OPT) -DNDEBUG
FLAGS_debug   := -O0
FLAGS_asan    := -O1 -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer $(UNINITIALIZED)
FLAGS_tsan    := -O1 -fsanitize=thread $(UNINITIALIZED)
ifndef FLAGS_$(BUILD)
$(error BUILD=$(BUILD) is none of release, debug, asan, tsan)
endif

# No flag here may change what a floating-point operation yields: pictures are the same from every build.
WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wstrict-prototypes -Wmissing-prototypes -Wvla
CFLAGS_ALL := -std=c11 -D_GNU_SOURCE -g -ffp-contract=off -fno-math-errno -fno-trapping-math $(WARNINGS) \
              $(FLAGS_$(BUILD)) -Isrc -I. $(shell pkg-config --cflags lua5.4 2>/dev/null) \
              $(shell pkg-config --cflags libdeflate 2>/dev/null) $(CFLAGS)
LIBS := $(shell pkg-config --libs lua5.4 2>/dev/null || echo -llua5.4) \
        $(shell pkg-config --libs libdeflate 2>/dev/null || echo -ldeflate) -llodepng -lm -lpthread
TEST_LIBS := -lcmocka -lmpfr -lgmp $(if $(findstring clang,$(CC)),,-lquadmath)
STRICT := $(if $(filter 1,$(WERROR)),-Werror)
Q := $(if $(V),,@)

SOURCES := $(wildcard scene_lua.c $(foreach depth,/ /*/ /*/*/ /*/*/*/,src$(depth)*.c))
SUPPORT := $(wildcard tests/support/*.c)
TESTS   := $(patsubst %.c,$(OUT)/%,$(wildcard tests/test_*.c))
STABILITY := $(OUT)/tests/stability/stability
PRECISION := $(OUT)/tests/bench/precision
REFERENCE := $(OUT)/tests/bench/reference
KERNELS := $(OUT)/tests/bench/kernels/kernels
object   = $(patsubst %.c,$(OUT)/obj/%.o,$(1))
OBJECTS := $(call object,$(SOURCES) $(SUPPORT) \
           $(wildcard Main.c tests/test_*.c $(foreach folder,stability bench,tests/$(folder)/*.c)))
KERNELS_OBJECTS := $(call object,$(wildcard tests/bench/kernels/*.c))

all: $(PROGRAM)

$(PROGRAM): $(OUT)/obj/Main.o $(OUT)/librt.a
	@echo "  LD $@"
	$(Q)$(CC) $(CFLAGS_ALL) $(LDFLAGS) -o $@ $^ $(LIBS)

$(OUT)/librt.a: $(call object,$(SOURCES))
	@rm -f $@
	@ar rcs $@ $^

$(OUT)/libsupport.a: $(call object,$(SUPPORT))
	@mkdir -p $(@D) && rm -f $@
	@ar rcs $@ $^

# Tests that make allocations fail have theirs wrapped, no others.
wrap = $(if $(shell grep -l 'support/alloc_fail\.h"' $*.c),-Wl$(,)--wrap=malloc$(,)--wrap=calloc$(,)--wrap=realloc$(,)--wrap=aligned_alloc)
, := ,
$(TESTS) $(PRECISION) $(REFERENCE): $(OUT)/%: $(OUT)/obj/%.o $(OUT)/libsupport.a $(OUT)/librt.a
	@mkdir -p $(@D)
	@echo "  LD $@"
	$(Q)$(CC) $(CFLAGS_ALL) $(LDFLAGS) $(wrap) -o $@ $^ $(LIBS) $(TEST_LIBS)

$(STABILITY): $(call object,$(wildcard tests/stability/*.c)) $(OUT)/libsupport.a $(OUT)/librt.a
	@mkdir -p $(@D)
	@echo "  LD $@"
	$(Q)$(CC) $(CFLAGS_ALL) $(LDFLAGS) -o $@ $^ $(LIBS) $(TEST_LIBS)

$(KERNELS): $(KERNELS_OBJECTS) $(OUT)/libsupport.a $(OUT)/librt.a
	@mkdir -p $(@D)
	@echo "  LD $@"
	$(Q)$(CC) $(CFLAGS_ALL) $(LDFLAGS) -o $@ $^ $(LIBS) $(TEST_LIBS) -lembree3

$(OUT)/obj/tests/%.o: CFLAGS_ALL += -Itests
$(OUT)/obj/%.o: %.c $(OUT)/flags
	@mkdir -p $(@D)
	@echo "  CC $<"
	$(Q)$(CC) $(CFLAGS_ALL) $(STRICT) -MMD -MP -c -o $@ $<

# Changes only when the command line does, and has everything compiled again then.
$(OUT)/flags: FORCE
	@mkdir -p $(@D); echo '$(CC) $(CFLAGS_ALL)' | cmp -s - $@ || echo '$(CC) $(CFLAGS_ALL)' >$@

-include $(OBJECTS:.o=.d) $(KERNELS_OBJECTS:.o=.d)

# Everything that can be compiled, the tests too; `tests` builds them without running them.
objects: $(OBJECTS)
tests: $(PROGRAM) $(TESTS) $(STABILITY) $(PRECISION) $(REFERENCE)

# Debian packages: to build, to test, to benchmark.
BUILD_PACKAGES := gcc libc6-dev make pkg-config liblua5.4-dev liblodepng-dev libdeflate-dev libcglm-dev
TEST_PACKAGES  := libcmocka-dev libmpfr-dev valgrind lua5.4 povray premake4 clang
BENCH_PACKAGES := libcmocka-dev libmpfr-dev libembree-dev povray lua5.4 gnuplot-nox

deps: ; @.ci/install $(BUILD_PACKAGES) $(TEST_PACKAGES) $(BENCH_PACKAGES)
deps-build: ; @.ci/install $(BUILD_PACKAGES)
deps-test: ; @.ci/install $(BUILD_PACKAGES) $(TEST_PACKAGES)
deps-bench: ; @.ci/install $(BUILD_PACKAGES) $(BENCH_PACKAGES)

# The steps are makes of their own: what the first installs must be there when the next looks for it.
demo: deps-build
	@$(MAKE) --no-print-directory all BUILD=release
	./rt Assets/final/temple.lua -o temple.png --size 1024x1024
	@echo "The picture is $(CURDIR)/temple.png"

test: deps-test
	+@tests/run.sh

# LONG=1: more trials, hours of them. CASES='24.2 27': these rows alone.
stability: deps-test
	@$(MAKE) --no-print-directory build/release/tests/stability/stability BUILD=release
	build/release/tests/stability/stability $(if $(LONG),--long,--full) $(CASES)

# One after the other, so that they don't take each other's processors.
bench:
	@$(MAKE) --no-print-directory bench-kernels
	@$(MAKE) --no-print-directory bench-scenes

bench-kernels: deps-bench
	@$(MAKE) --no-print-directory build/release/tests/bench/kernels/kernels BUILD=release
	build/release/tests/bench/kernels/kernels --json build/bench-kernels.json
	@echo "The table is also build/bench-kernels.json"

bench-scenes: deps-bench
	@$(MAKE) --no-print-directory all BUILD=release
	tests/bench/scenes.sh

precision: deps-bench
	@$(MAKE) --no-print-directory build/release/tests/bench/precision BUILD=release
	build/release/tests/bench/precision
	gnuplot tests/bench/precision.gnuplot
	@echo "The table is also build/precision.csv, the plot build/precision.svg"

calibration: deps-bench
	@$(MAKE) --no-print-directory all build/release/tests/bench/reference BUILD=release
	tests/bench/calibration.sh

error-time: deps-bench
	@$(MAKE) --no-print-directory all build/release/tests/bench/reference BUILD=release
	tests/bench/error_time.sh

lint: ; @tests/lint.sh

install: all
	install -D -m 755 $(PROGRAM) $(DESTDIR)$(PREFIX)/bin/rt

clean:
	rm -rf build rt

help:
	@echo 'make [all]    build ./rt'
	@echo 'make demo     install what the build needs, build, render the temple to temple.png'
	@echo 'make test     install what the tests need, build and run them all'
	@echo 'make stability  print the table of stiff and extreme cases (LONG=1: more trials, CASES=24.2: one row)'
	@echo 'make lint     check the rules of the code'
	@echo 'make bench    install what the benchmarks need, run both:'
	@echo 'make bench-kernels  rays and builds against Embree (a part: see tests/bench/kernels/kernels.c)'
	@echo 'make bench-scenes   whole runs against POV-Ray, triangles, pixels, threads'
	@echo 'make precision  measure error against time of the primitives and solvers'
	@echo 'make calibration  how often the reported interval holds the true error'
	@echo 'make error-time   error against seconds, beside POV-Ray'
	@echo 'make deps     install all packages (apt-get; elsewhere it says their names)'
	@echo 'make install  to $(DESTDIR)$(PREFIX)/bin'
	@echo 'make clean    remove all that was built'
	@echo 'Settings: BUILD=release|debug|asan|tsan CC=gcc|clang OPT=-O3 WERROR=1 V=1 JOBS=N PREFIX=DIR'

FORCE:
.SECONDARY:
.PHONY: all objects tests deps deps-build deps-test deps-bench demo test stability bench bench-kernels bench-scenes precision calibration error-time lint install clean help FORCE
