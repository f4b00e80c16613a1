-- Makes the phoenix of the roof, phoenix.obj: lua5.4 Assets/make/phoenix.lua
-- It stands on y = 0 and looks to +z. Body, legs and every feather are tubes of elliptic section along smooth curves.
local here = arg[0]:match("^(.*/)") or ""
package.path = here .. "?.lua;" .. package.path
local obj = require "obj"

local function add(a, b, k)
    return { a[1] + b[1] * k, a[2] + b[2] * k, a[3] + b[3] * k }
end

local function dot(a, b)
    return a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
end

local function cross(a, b)
    return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] }
end

local function normalised(a)
    local l = math.sqrt(dot(a, a))
    return { a[1] / l, a[2] / l, a[3] / l }
end

-- Catmull and Rom's spline through rows of numbers of any length, at t from 1 to #rows.
local function spline(rows, t)
    local i = math.max(1, math.min(#rows - 1, math.floor(t)))
    local f = t - i
    local a, b, c, d = rows[math.max(1, i - 1)], rows[i], rows[i + 1], rows[math.min(#rows, i + 2)]
    local p = {}
    for k = 1, #b do
        p[k] = b[k] + 0.5 * f * (c[k] - a[k] + f * (2 * a[k] - 5 * b[k] + 4 * c[k] - d[k]
            + f * (3 * (b[k] - c[k]) + d[k] - a[k])))
    end
    return p
end

-- A tube through rows {x, y, z, width, thickness}; `flat` is a direction in which the section is thin.
local function tube(mesh, rows, flat, around, steps)
    local function ring(j)
        local t = 1 + (#rows - 1) * j / steps
        local p = spline(rows, t)
        local before, after = spline(rows, math.max(1, t - 0.01)), spline(rows, math.min(#rows, t + 0.01))
        local ahead = normalised(add(after, before, -1))
        local thin = normalised(add(flat, ahead, -dot(flat, ahead)))
        return p, cross(thin, ahead), thin
    end
    mesh:grid(around, steps, function(i, j)
        local p, wide, thin = ring(j)
        local angle = 2 * math.pi * i / around
        local c, s = math.cos(angle), math.sin(angle)
        local w, h = math.max(p[4], 1e-3), math.max(p[5], 1e-3)
        local at = add(add(p, wide, w * c), thin, -h * s)
        local normal = normalised(add(add({ 0, 0, 0 }, wide, h * c), thin, -w * s))
        return { { at[1], at[2], at[3] }, nil, normal }
    end)
end

local function body(mesh)
    tube(mesh, {
        { 0, 0.60, -0.60, 0.02, 0.02 }, { 0, 0.60, -0.42, 0.09, 0.10 }, { 0, 0.60, -0.18, 0.17, 0.19 },
        { 0, 0.66, 0.06, 0.22, 0.22 }, { 0, 0.80, 0.24, 0.20, 0.19 }, { 0, 0.99, 0.31, 0.13, 0.11 },
        { 0, 1.16, 0.28, 0.085, 0.075 }, { 0, 1.30, 0.28, 0.08, 0.07 }, { 0, 1.40, 0.35, 0.09, 0.085 },
        { 0, 1.41, 0.45, 0.065, 0.06 }, { 0, 1.37, 0.55, 0.035, 0.025 }, { 0, 1.31, 0.62, 0.002, 0.002 },
    }, { 1, 0, 0 }, 12, 40)
end

-- Three plumes on the head and wattles under the beak.
local function head(mesh)
    for k = 0, 2 do
        local back = -0.10 * k
        tube(mesh, {
            { 0, 1.45, 0.36 + 0.4 * back, 0.03, 0.012 }, { 0, 1.58, 0.34 + back, 0.035, 0.012 },
            { 0, 1.66 - 0.03 * k, 0.22 + 1.2 * back, 0.03, 0.012 },
            { 0, 1.64 - 0.05 * k, 0.12 + 1.3 * back, 0.004, 0.004 },
        }, { 1, 0, 0 }, 6, 8)
    end
    tube(mesh, { { 0, 1.35, 0.47, 0.03, 0.012 }, { 0, 1.26, 0.48, 0.03, 0.015 }, { 0, 1.2, 0.46, 0.004, 0.004 } },
        { 1, 0, 0 }, 6, 5)
end

-- Flight feathers fan out from the shoulder, the outer ones steeper and longer; coverts lie over their roots.
local function wing(mesh, side)
    local function feather(share, length, width, root)
        local rise = math.rad(8 + 74 * share)
        local out, up = math.cos(rise), math.sin(rise)
        local back = -0.35 * (1 - share)
        local shoulder = { side * (0.15 + 0.1 * share), 0.76 + 0.12 * share + 0.02 * root, 0.12 - 0.22 * (1 - share) }
        local rows, widths = {}, { 0.5, 1, 0.9, 0.1 }
        for i, d in ipairs { 0, 0.35, 0.75, 1 } do
            local bend = 0.22 * d * d
            rows[i] = {
                shoulder[1] + side * length * (d * out + 0.25 * bend * up),
                shoulder[2] + length * (d * up - 0.2 * bend * out),
                shoulder[3] + length * (back * d - bend) + 0.03 * root,
                width * widths[i], 0.02,
            }
        end
        tube(mesh, rows, { 0, -0.25 * out, 1 }, 6, 8)
    end
    for i = 0, 7 do
        feather(i / 7, 0.72 + 0.42 * i / 7, 0.085, 0)
    end
    for i = 0, 4 do
        feather(0.05 + 0.85 * i / 4, 0.46 + 0.12 * i / 4, 0.1, 1)
    end
end

-- Long tail feathers sweep up behind like flames and curl at their tips.
local function tail(mesh)
    for i = -3, 3 do
        local spread = i / 3
        local high = 1 - 0.45 * spread * spread
        tube(mesh, {
            { 0.03 * i, 0.60, -0.42, 0.04, 0.02 }, { 0.16 * spread, 0.66 + 0.05 * high, -0.72, 0.07, 0.02 },
            { 0.36 * spread, 0.80 + 0.28 * high, -0.98, 0.10, 0.02 },
            { 0.52 * spread, 0.98 + 0.60 * high, -1.05, 0.10, 0.02 },
            { 0.60 * spread, 1.10 + 0.86 * high, -0.98, 0.07, 0.018 },
            { 0.64 * spread, 1.13 + 0.98 * high, -0.84, 0.01, 0.01 },
        }, { 0.25 * spread, 0.5, 1 }, 6, 14)
    end
end

local function leg(mesh, side)
    local x = 0.09 * side
    tube(mesh, { { x, 0.55, -0.02, 0.09, 0.09 }, { x, 0.40, 0.02, 0.06, 0.06 }, { x, 0.26, -0.03, 0.03, 0.03 },
        { x, 0.12, 0.0, 0.026, 0.026 }, { x, 0.0, 0.02, 0.03, 0.03 } }, { 0, 0, 1 }, 8, 12)
    for toe = -1, 1 do
        tube(mesh, { { x, 0.03, 0.0, 0.028, 0.028 }, { x + 0.05 * toe, 0.03, 0.09, 0.024, 0.024 },
            { x + 0.09 * toe, 0.0, 0.17, 0.004, 0.004 } }, { 0, 1, 0 }, 6, 5)
    end
end

local phoenix = obj.new("phoenix, made by make/phoenix.lua")
body(phoenix)
head(phoenix)
tail(phoenix)
for _, side in ipairs { -1, 1 } do
    wing(phoenix, side)
    leg(phoenix, side)
end
phoenix:write(here .. "../final/phoenix.obj")
