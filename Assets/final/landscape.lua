-- What lies round the temple: the lake, the islands with their rocks and trees, and the mountains.
local build = require "build"
local material = require "materials"

local landscape = {}

local lake_size = 420          -- side of the lake's square, its middle at z = lake_z
local lake_z = -130

-- The lake with circular waves about the point (x, z). Bumps turn the normals of the unit square by up to a radian;
-- scaling it up by so much more sideways than upwards flattens them to ripples of the given greatest slope.
function landscape.lake(x, z, wavelength, reach, slope)
    local lake = build.mesh("lake", "lake.obj", material.water)
    lake:scale(lake_size, lake_size * slope / math.tan(1), lake_size)
    lake:translate(0, 0, lake_z)
    local u, v = x / lake_size + 0.5, 0.5 - 0.99 * (z - lake_z) / lake_size
    lake:mesh_add_bumps({ u, v }, reach / wavelength, wavelength / lake_size)
    return lake
end

-- A mountain of the given width, height and depth whose foot has its middle at (x, z), a little below the water.
local function mountain(size, x, z, turn, roughness, subdivisions, seed, look)
    local node = gr.fractal_mountain("mountain", size, roughness, subdivisions, seed)
    build.paint(node, look)
    node:translate(-size[1] / 2, -0.5, size[3] / 2)
    node:rotate("y", turn)
    node:translate(x, 0, z)
    return node
end

function landscape.mountains()
    local near, far = material.near_mountain, material.far_mountain
    return build.group("mountains", {
        mountain({ 160, 30, 100 }, 88, -195, 15, 0.13, 4, 7, near),
        mountain({ 130, 20, 90 }, 10, -215, -15, 0.12, 4, 3, near),
        mountain({ 150, 22, 100 }, -100, -205, 10, 0.12, 4, 12, near),
        mountain({ 170, 30, 110 }, -215, -165, 50, 0.12, 4, 15, near),
        mountain({ 170, 24, 100 }, -235, -50, 80, 0.12, 4, 18, near),
        mountain({ 300, 118, 220 }, 135, -480, 0, 0.11, 4, 27, far),
        mountain({ 360, 95, 200 }, -235, -500, 15, 0.10, 4, 5, far),
        mountain({ 300, 62, 160 }, 10, -430, -10, 0.10, 4, 9, far),
    })
end

-- The woods on the far shore: rows of trees, conifers to the back, leafy ones in autumn colours to the front.
function landscape.woods()
    local group = gr.node("woods")
    local conifers, crowns = {}, {}
    for i, look in ipairs(material.forest) do
        conifers[i] = i <= 2 and build.mesh("conifer", "conifer.obj", look) or conifers[i - 2]
        crowns[i] = build.mesh("crown", "crown.obj", look)
    end
    local function stand(kinds, z, spacing, least, most)
        for x = -110, 110, spacing do
            local tree = gr.node("tree")
            local height = least + (most - least) * math.random()
            local width = height * (0.85 + 0.4 * math.random())
            tree:scale(width, height, width)
            tree:rotate("y", math.random(360))
            tree:translate(x + spacing * (math.random() - 0.5), -0.4, z + 6 * (math.random() - 0.5))
            tree:add_child(kinds[math.random(#kinds)])
            group:add_child(tree)
        end
    end
    stand(conifers, -152, 2.4, 8, 14)
    stand(conifers, -147, 2.6, 6, 11)
    stand(crowns, -141, 2.3, 4, 7)
    stand(crowns, -136, 2.0, 2.5, 4.5)
    return group
end

-- Rocks are small fractal mountains. places: {x, z, width, height, turn}.
local function rocks(places)
    local group = gr.node("rocks")
    local shapes = {}
    for i = 1, 3 do
        shapes[i] = gr.fractal_mountain("rock", { 1, 0.8, 1 }, 0.14, 3, 40 + i)
        build.paint(shapes[i], material.rock)
        shapes[i]:translate(-0.5, 0, 0.5)
    end
    for i, p in ipairs(places) do
        local rock = gr.node("rock")
        rock:scale(p[3], p[4], p[3])
        rock:rotate("y", p[5])
        rock:translate(p[1], -0.15, p[2])
        rock:add_child(shapes[i % #shapes + 1])
        group:add_child(rock)
    end
    return group
end

-- The tree of tree.grammar: bark on cylinders, leaves of one colour.
function landscape.tree(depth, leaf_material, seed)
    local trunk = build.paint(gr.cylinder("trunk"), material.bark)
    local leaf = build.mesh("leaf", "leaves.obj", leaf_material)
    return gr.tree("tree", "tree.grammar", depth, trunk, leaf, seed)
end

-- The temple's island, with trees behind.
function landscape.island()
    local group = gr.node("island")
    group:add_child(build.mesh("ground", "island.obj", material.moss))
    group:add_child(rocks {
        { -11.5, -5.5, 2.6, 1.5, 20 }, { -13.2, -7.5, 2.0, 0.9, 80 }, { 13.5, -2.5, 2.4, 1.3, 140 },
        { 15.6, -2.2, 1.5, 0.8, 10 }, { 18.5, -3.0, 3.0, 1.2, 60 }, { -9.6, -3.6, 1.2, 0.7, 100 },
        { 10.4, 1.2, 1.5, 0.7, 45 }, { 26, -8, 2.8, 1.3, 75 },
    })
    local green, amber = landscape.tree(6, material.green_leaf, 11), landscape.tree(6, material.amber_leaf, 4)
    for i, p in ipairs {
        { -11, -12, 0.55 }, { -6, -17, 0.62 }, { 13, -9, 0.62 }, { 17.5, -12, 0.74 }, { 24, -12, 0.5 },
    } do
        local tree = gr.node("background tree")
        tree:scale(p[3], p[3], p[3])
        tree:rotate("y", 67 * i)
        tree:translate(p[1], 0.3, p[2])
        tree:add_child(i % 3 == 1 and amber or green)
        group:add_child(tree)
    end
    return group
end

-- The islet with the large tree.
function landscape.islet()
    local group = gr.node("islet")
    group:add_child(build.mesh("ground", "islet.obj", material.moss))
    group:add_child(rocks {
        { 4.3, 0.9, 1.7, 1.3, 30 }, { 5.2, 0.2, 1.1, 0.8, 75 }, { 3.2, 1.9, 1.3, 0.9, 120 }, { 2.2, 2.6, 1.0, 0.7, 10 },
        { 5.6, 1.3, 0.8, 0.5, 50 }, { -2.6, 2.0, 1.6, 0.9, 80 },
    })
    local tree = landscape.tree(6, material.red_leaf, 2)
    tree:translate(0, 0.4, 0)
    group:add_child(tree)
    return group
end

-- Wild geese in a wedge, the first of them at (x, y, z).
function landscape.geese(x, y, z)
    local group = gr.node("geese")
    local goose = build.mesh("goose", "goose.obj", material.dark_wood)
    for i = 0, 6 do
        local behind = (i + 1) // 2
        local bird = gr.node("goose")
        bird:scale(1.4, 1 + 0.8 * math.random(), 1.4)
        bird:rotate("y", 28)
        bird:translate(x + 2.3 * behind, y + (i % 2 == 0 and 1.1 or -0.8) * behind, z - 2 * behind)
        bird:add_child(goose)
        group:add_child(bird)
    end
    return group
end

-- Fallen leaves afloat before the islet.
function landscape.fallen_leaves()
    local group = gr.node("fallen leaves")
    local leaf = build.mesh("leaf", "fallen_leaf.obj", material.red_leaf)
    for _ = 1, 90 do
        local fallen = gr.node("fallen leaf")
        local size = 0.16 + 0.1 * math.random()
        fallen:scale(size, 1, size)
        fallen:rotate("y", math.random(360))
        fallen:translate(-13 + 14 * math.random() ^ 1.5, 0.012, 14 + 32 * math.random())
        fallen:add_child(leaf)
        group:add_child(fallen)
    end
    return group
end

return landscape
