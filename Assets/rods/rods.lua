-- Rods a fifth of a pixel wide, on a checker whose squares are less than a pixel at the back, before mirrors: what samples
-- at the pixels' centres can't draw. Two ruled surfaces, a hyperboloid and a saddle, have no curved part.

local RADIUS = 0.0012     -- a pixel of a 512 x 512 picture is 0.011 wide at the hyperboloid
local SQUARE = 0.04

local steel = gr.material({ 0.80, 0.88, 1.00 }, { 0.9, 0.9, 0.9 }, 20)
local brass = gr.material({ 1.00, 0.72, 0.26 }, { 0.9, 0.9, 0.9 }, 20)
local light_stone = gr.material({ 0.50, 0.49, 0.46 }, { 0, 0, 0 }, 1)
local dark_stone = gr.material({ 0.05, 0.06, 0.09 }, { 0, 0, 0 }, 1)
local mirror = gr.reflective_material({ 0.10, 0.11, 0.13 }, { 0.6, 0.6, 0.6 }, 120, 0.8)
local frame = gr.material({ 0.28, 0.16, 0.10 }, { 0.1, 0.1, 0.1 }, 10)

local scene = gr.node("scene")

-- A cylinder from p to q.
local function rod(p, q, material)
    local dx, dy, dz = q[1] - p[1], q[2] - p[2], q[3] - p[3]
    local length = math.sqrt(dx * dx + dy * dy + dz * dz)
    local piece = gr.cylinder("rod")
    piece:set_material(material)
    piece:scale(RADIUS, length / 2, RADIUS)
    piece:rotate("z", -math.deg(math.acos(dy / length)))
    piece:rotate("y", math.deg(math.atan(-dz, dx)))
    piece:translate((p[1] + q[1]) / 2, (p[2] + q[2]) / 2, (p[3] + q[3]) / 2)
    scene:add_child(piece)
end

-- The squares of one colour, as a mesh: x from -side to side, z from -back to front.
local function squares(colour, side, back, front)
    local vertices, faces = {}, {}
    for i = 0, math.floor(2 * side / SQUARE) - 1 do
        for k = 0, math.floor((back + front) / SQUARE) - 1 do
            if (i + k) % 2 == colour then
                local x, z, n = -side + i * SQUARE, front - k * SQUARE, #vertices
                vertices[n + 1], vertices[n + 2] = { x, 0, z }, { x + SQUARE, 0, z }
                vertices[n + 3], vertices[n + 4] = { x + SQUARE, 0, z - SQUARE }, { x, 0, z - SQUARE }
                faces[#faces + 1] = { n, n + 1, n + 2, n + 3 }
            end
        end
    end
    return gr.mesh("squares", vertices, faces)
end

for colour, stone in pairs({ [0] = light_stone, [1] = dark_stone }) do
    local floor = squares(colour, 6, 4.2, 4.2)
    floor:set_material(stone)
    scene:add_child(floor)
end

-- The hyperboloid: rods lean both ways between two circles.
local RODS, LEAN = 120, 118
for i = 0, RODS - 1 do
    local a = 2 * math.pi * i / RODS
    for _, lean in ipairs({ -LEAN, LEAN }) do
        local b = a + math.rad(lean)
        rod({ -1.25 + 1.05 * math.cos(a), 0, 1.05 * math.sin(a) },
            { -1.25 + 1.05 * math.cos(b), 3.1, 1.05 * math.sin(b) }, lean < 0 and steel or brass)
    end
end

-- The saddle: rods between two lines that are askew.
for i = 0, 100 do
    local s = i / 100
    rod({ 0.5 + 1.9 * s, 0.05 + 2.2 * s, 1.2 }, { 0.5 + 1.9 * s, 2.25 - 2.2 * s, -1.2 }, brass)
end

-- A ball in each, and a mirror at the back that shows them from behind.
for _, place in ipairs({ { -1.25, 0.42, 0, 0.42 }, { 1.45, 0.32, 1.1, 0.32 } }) do
    local ball = gr.nh_sphere("ball", { place[1], place[2], place[3] }, place[4])
    ball:set_material(mirror)
    scene:add_child(ball)
end
local function slab(name, x, y, z, width, height, depth, material)
    local piece = gr.cube(name)
    piece:set_material(material)
    piece:scale(width, height, depth)
    piece:translate(x, y, z)
    piece:rotate("y", -9)
    scene:add_child(piece)
end
slab("frame", -3.6, 0, -3.35, 7.2, 3.6, 0.1, frame)
slab("mirror", -3.5, 0.1, -3.25, 7.0, 3.4, 0.05, mirror)

gr.render(scene, "rods.png", 512, 512, { 0.5, 2.5, 9 }, { -0.055, -0.13, -1 }, { 0, 1, 0 }, 34, { 0.38, 0.38, 0.40 },
    { gr.light({ -12, 22, 16 }, { 0.75, 0.72, 0.66 }, { 1, 0, 0 }), gr.light({ 14, 12, 10 }, { 0.35, 0.37, 0.42 }, { 1, 0, 0 }) },
    { background = { 0.02, 0.03, 0.06 } })
