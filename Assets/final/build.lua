-- Small helpers for putting a scene together.
local build = {}

-- Gives a node its look: a material, or a table of a material and the picture that replaces its diffuse colour.
function build.paint(node, look)
    if type(look) == "table" then
        node:set_material(look[1])
        node:add_texture(look[2])
    else
        node:set_material(look)
    end
    return node
end

-- A box between two opposite corners.
function build.box(name, look, low, high)
    local box = build.paint(gr.cube(name), look)
    box:scale(high[1] - low[1], high[2] - low[2], high[3] - low[3])
    box:translate(low[1], low[2], low[3])
    return box
end

-- An upright cylinder from the height y0 to y1.
function build.column(name, look, radius, x, y0, y1, z)
    local column = build.paint(gr.cylinder(name), look)
    column:scale(radius, (y1 - y0) / 2, radius)
    column:translate(x, (y0 + y1) / 2, z)
    return column
end

function build.mesh(name, file, look)
    return build.paint(gr.mesh(name, file), look)
end

function build.group(name, children)
    local group = gr.node(name)
    for _, child in ipairs(children) do
        group:add_child(child)
    end
    return group
end

-- Puts one more instance of `node` below `parent`, turned about y (degrees, 0 if left out) and then moved.
function build.place(parent, node, x, y, z, turn)
    local instance = gr.node("place")
    instance:rotate("y", turn or 0)
    instance:translate(x, y, z)
    instance:add_child(node)
    parent:add_child(instance)
    return instance
end

-- Calls make(turn, half, out) for the four sides of a rectangle of half-widths x and z: turning by `turn` about y takes
-- the front (+z) to that side, `half` is half the side's length and `out` its distance from the middle.
function build.four_sides(x, z, make)
    make(0, x, z)
    make(90, z, x)
    make(180, x, z)
    make(270, z, x)
end

return build
