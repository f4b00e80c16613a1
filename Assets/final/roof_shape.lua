-- The curved surface of a hipped roof with upturned corners, as a function. Used both by the script that makes the
-- meshes and by the scene that lays the tiles.
--
-- A side is seen in its own frame: x along the eave, z outward, y up from the eave's middle. v is 0 at the eave and 1
-- at the top, u goes from -1 to 1 from hip to hip.
local shape = {}
shape.__index = shape

-- eave, top: half-widths {x, z} of the lower and upper edge; rise: height between them; sag: how much the slope hangs
-- through (0 straight); lift: how far the corners turn up.
shape.lower = setmetatable({ eave = { 7.5, 6.2 }, top = { 3.05, 3.05 }, rise = 2.0, sag = 0.50, lift = 0.75,
    thickness = 0.24 }, shape)
shape.upper = setmetatable({ eave = { 4.45, 4.45 }, top = { 0.3, 0.3 }, rise = 2.45, sag = 0.55, lift = 0.62,
    thickness = 0.20 }, shape)

local function lerp(a, b, t)
    return a + (b - a) * t
end

-- Half-length of the side and its distance from the middle at v. axis: 1 for the sides that run along x, 2 along z.
function shape:half(axis, v)
    return lerp(self.eave[axis], self.top[axis], v)
end

function shape:out(axis, v)
    return lerp(self.eave[3 - axis], self.top[3 - axis], v)
end

-- The corner's lift falls off quickly along the eave and up the hip.
function shape:height(u, v)
    return self.rise * ((1 - self.sag) * v + self.sag * v * v) + self.lift * math.abs(u) ^ 3.5 * (1 - v) ^ 1.5
end

-- The point at (u, v).
function shape:point(axis, u, v)
    return { u * self:half(axis, v), self:height(u, v), self:out(axis, v) }
end

-- The point at the distance x from the side's middle line.
function shape:point_at(axis, x, v)
    local half = self:half(axis, v)
    return { x, self:height(half > 0 and math.max(-1, math.min(1, x / half)) or 0, v), self:out(axis, v) }
end

-- The v where the line at x up the slope meets the hip; 1 if it reaches the top.
function shape:hip(axis, x)
    local eave, top = self.eave[axis], self.top[axis]
    return math.max(0, math.min(1, (eave - math.abs(x)) / (eave - top)))
end

return shape
