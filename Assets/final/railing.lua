-- Railings of terraces: posts, three rails, and corner posts with an onion-shaped cap.
local build = require "build"

local railing = {}

local height = 0.62

local function corner_post(material, cap_material)
    local cap = gr.sphere("onion")
    cap:set_material(cap_material)
    cap:scale(0.085, 0.1, 0.085)
    cap:translate(0, height + 0.28, 0)
    local tip = gr.cone("tip")
    tip:set_material(cap_material)
    tip:scale(0.05, 0.14, 0.05)
    tip:translate(0, height + 0.46, 0)
    return build.group("corner post", {
        build.column("post", material, 0.07, 0, 0, height + 0.16, 0),
        build.column("collar", cap_material, 0.085, 0, height + 0.16, height + 0.2, 0),
        cap, tip,
    })
end

-- A railing along x from -half to half at z = 0, without corner posts. The top rail runs on a little past the corner.
local function side(half, material)
    local group = gr.node("railing side")
    local function rail(y, size, past)
        group:add_child(build.box("rail", material, { -half - past, y - size / 2, -size / 2 },
            { half + past, y + size / 2, size / 2 }))
    end
    rail(height, 0.075, 0.22)
    rail(0.62 * height, 0.05, 0)
    rail(0.2 * height, 0.055, 0)
    local count = math.max(2, math.floor(2 * half / 0.85 + 0.5))
    for i = 1, count - 1 do
        local x = -half + 2 * half * i / count
        group:add_child(build.box("baluster", material, { x - 0.03, 0, -0.03 }, { x + 0.03, height - 0.035, 0.03 }))
    end
    return group
end

-- Round a rectangle of half-widths x and z, standing on y = 0. open: has the turns (0 front, 90 right, 180 back, 270
-- left) of the sides without railing as keys.
function railing.around(x, z, material, cap_material, open)
    local group = gr.node("railing")
    local post = corner_post(material, cap_material)
    local made = {}
    build.four_sides(x, z, function(turn, half, out)
        made[half] = made[half] or side(half, material)
        if not open[turn] then
            -- The rails of neighbouring sides cross at the corners: every other side stands a little higher.
            local lift = turn % 180 == 0 and 0 or 0.02
            local placed = gr.node("side")
            build.place(placed, made[half], 0, lift, out)
            placed:rotate("y", turn)
            group:add_child(placed)
        end
    end)
    for _, corner in ipairs { { x, z }, { -x, z }, { x, -z }, { -x, -z } } do
        build.place(group, post, corner[1], 0, corner[2])
    end
    return group
end

return railing
