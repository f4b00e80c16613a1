-- A Japanese oil-paper umbrella as one CSG solid: a thin bowl with a scalloped rim and a white band (the "snake's
-- eye"), struts below it, a shaft with a tip, and a crook handle.
local material = require "materials"

local umbrella = {}

local lacquer, paper, bamboo, grip = material.lacquer, material.paper, material.bamboo, material.dark_wood

local function solid(shape, solid_material, sx, sy, sz, x, y, z)
    shape:set_material(solid_material)
    shape:scale(sx, sy, sz)
    shape:translate(x or 0, y or 0, z or 0)
    return shape
end

local function union_of(name, parts)
    local all = parts[1]
    for i = 2, #parts do
        all = gr.union(name, all, parts[i])
    end
    return all
end

-- The space between two bowls of radius 1 and 0.62 high, above the rim.
local function shell(shell_material, outer, inner)
    local hollow = gr.diff("shell", solid(gr.sphere("outer"), shell_material, outer, 0.62 * outer, outer),
        solid(gr.sphere("inner"), shell_material, inner, 0.60 * inner, inner))
    return gr.intersect("bowl", hollow, solid(gr.cube("above the rim"), shell_material, 2.4, 1, 2.4, -1.2, 0.1, -1.2))
end

-- One ellipsoid for each gore takes a scallop out of the rim.
local function scalloped(canopy, gores)
    for i = 1, gores do
        local bite = solid(gr.sphere("scallop"), lacquer, 0.3, 0.13, 0.25, 1, 0.1, 0)
        bite:rotate("y", 360 * (i + 0.5) / gores)
        canopy = gr.diff("canopy", canopy, bite)
    end
    return canopy
end

-- The band stands out of the canopy by a hair on both sides.
local function band()
    local tube = gr.diff("tube", solid(gr.cylinder("outer"), paper, 0.74, 1, 0.74),
        solid(gr.cylinder("inner"), paper, 0.52, 1.1, 0.52))
    return gr.intersect("band", shell(paper, 1.006, 0.964), tube)
end

-- Struts from the runner on the shaft to the canopy.
local function struts(count)
    local parts = {}
    for i = 1, count do
        local strut = solid(gr.cylinder("strut"), bamboo, 0.011, 0.36, 0.011, 0, 0.36)
        strut:rotate("z", -62)
        strut:translate(0.02, 0.12, 0)
        strut:rotate("y", 360 * i / count)
        parts[i] = strut
    end
    return union_of("struts", parts)
end

-- The crook: half a ring below the shaft, a ball on its end.
local function crook()
    local ring = gr.torus("ring", 0.22)
    ring:rotate("x", 90)
    solid(ring, grip, 0.15, 0.15, 0.15, 0.15, -1.1, 0)
    local half = gr.diff("half ring", ring, solid(gr.cube("upper half"), grip, 0.6, 0.4, 0.4, -0.15, -1.1, -0.2))
    return gr.union("crook", half, solid(gr.sphere("ball"), grip, 0.042, 0.05, 0.042, 0.3, -1.1, 0))
end

local function shaft()
    local rod = solid(gr.cylinder("rod"), bamboo, 0.026, 0.9, 0.026, 0, -0.25)
    local sleeve = solid(gr.cylinder("sleeve"), grip, 0.034, 0.16, 0.034, 0, -0.96)
    local runner = solid(gr.cylinder("runner"), grip, 0.05, 0.06, 0.05, 0, 0.12)
    local tip = solid(gr.cone("tip"), grip, 0.07, 0.22, 0.07, 0, 0.78)
    return union_of("shaft", { rod, sleeve, runner, tip, crook() })
end

-- Opens downwards, radius 1, from y = -1.3 (crook) to 0.78 (tip).
function umbrella.make()
    local canopy = gr.union("canopy", scalloped(shell(lacquer, 1, 0.97), 12), band())
    return union_of("umbrella", { canopy, struts(12), shaft() })
end

return umbrella
