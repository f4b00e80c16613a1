-- A hilly landscape of about TRIANGLES triangles: FOLDER/terrain.obj and FOLDER/terrain.lua, the scene that shows it.
--   lua5.4 tests/bench/terrain.lua TRIANGLES FOLDER
local triangles, folder = tonumber(arg[1]), arg[2]
local side = math.floor(math.sqrt(triangles / 2) + 0.5)
local sin = math.sin

-- Waves in ten directions, each shorter and lower than the one before by the same factors; irrational ones, so that
-- nothing repeats.
local waves = {}
for i = 1, 10 do
    local turn, length, height = 2.399963 * i, 7 * 0.618034 ^ (i - 1), 0.7 * 0.66 ^ (i - 1)
    local k = 2 * math.pi / length
    waves[i] = {k * math.cos(turn), k * math.sin(turn), 1.7 * i * i, height}
end

local obj = assert(io.open(folder .. "/terrain.obj", "w"))
obj:setvbuf("full", 1 << 20)
for i = 0, side do
    for j = 0, side do
        local x, z, y = 16 * i / side - 8, 16 * j / side - 8, 0
        for k = 1, #waves do
            local w = waves[k]
            y = y + w[4] * sin(w[1] * x + w[2] * z + w[3])
        end
        obj:write(("v %.7g %.7g %.7g\n"):format(x, y, z))
    end
end
for i = 0, side - 1 do
    for j = 1, side do
        local a = i * (side + 1) + j
        local b = a + side + 1
        obj:write(("f %d %d %d\nf %d %d %d\n"):format(a, a + 1, b, b, a + 1, b + 1))
    end
end
obj:close()

local scene = assert(io.open(folder .. "/terrain.lua", "w"))
scene:write [[
local land = gr.mesh("land", "terrain.obj")
land:set_material(gr.material({ 0.6, 0.6, 0.5 }, { 0, 0, 0 }, 1))
local root = gr.node("root")
root:add_child(land)
gr.render(root, "terrain.png", 512, 512, { 0.5, 5, 11 }, { 0, -0.5, -1 }, { 0, 1, 0 }, 50, { 0.2, 0.2, 0.2 },
    { gr.light({ -9, 14, 8 }, { 0.8, 0.8, 0.8 }, { 1, 0, 0 }) })
]]
scene:close()
