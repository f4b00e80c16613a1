-- The same program by premake: `premake4 gmake && make -C build/premake config=release`, which gives build/premake/rt.
-- The Makefile is the reference for the flags.
solution "rt"
    configurations { "release", "debug" }
    location "build/premake"

    project "rt"
        kind "ConsoleApp"
        language "C"
        files { "Main.c", "scene_lua.c", "src/**.c" }
        includedirs { "src", "." }
        buildoptions { "-std=c11 -D_GNU_SOURCE -g -ffp-contract=off -fno-math-errno -fno-trapping-math",
                       "-Wall -Wextra -Wpedantic `pkg-config --cflags lua5.4 libdeflate`" }
        linkoptions { "`pkg-config --libs lua5.4 libdeflate`" }
        links { "lodepng", "m", "pthread" }
        targetdir "build/premake"

        configuration "release"
            buildoptions { "-O3" }
            defines { "NDEBUG" }
            objdir "build/premake/obj/release"

        configuration "debug"
            buildoptions { "-O0" }
            objdir "build/premake/obj/debug"
            targetsuffix "-debug"
