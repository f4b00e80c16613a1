-- Collects vertices and faces and writes them as a Wavefront OBJ file. Numbers are rounded to 4 digits after the point,
-- and equal vertices are written once.
local obj = {}
obj.__index = obj

function obj.new(comment)
    return setmetatable({ comment = comment, lists = { v = {}, vt = {}, vn = {} }, seen = {}, faces = {} }, obj)
end

local function format(kind, numbers)
    local words = { kind }
    for i, x in ipairs(numbers) do
        words[i + 1] = ("%.4f"):format(x + 0.0):gsub("%.?0+$", ""):gsub("^-0$", "0")
    end
    return table.concat(words, " ")
end

local function index(self, kind, numbers)
    local line = format(kind, numbers)
    if not self.seen[line] then
        local list = self.lists[kind]
        list[#list + 1] = line
        self.seen[line] = #list
    end
    return self.seen[line]
end

-- A corner {position, uv, normal}; uv and normal may be missing.
local function corner(self, c)
    local v = index(self, "v", c[1])
    local vt = c[2] and index(self, "vt", c[2]) or ""
    if c[3] then
        return v .. "/" .. vt .. "/" .. index(self, "vn", c[3])
    end
    return c[2] and v .. "/" .. vt or tostring(v)
end

-- A convex face, its corners counter-clockwise seen from outside. Corners that coincide are left out.
function obj:face(...)
    local words, last = { "f" }, nil
    local corners = { ... }
    for _, c in ipairs(corners) do
        local at = index(self, "v", c[1])
        if at ~= last and not (#words > 1 and at == self.first) then
            if #words == 1 then
                self.first = at
            end
            words[#words + 1] = corner(self, c)
            last = at
        end
    end
    if #words >= 4 then
        self.faces[#self.faces + 1] = table.concat(words, " ")
    end
end

-- A grid of faces between the corners corner_at(i, j), 0 <= i <= nx and 0 <= j <= ny, seen from outside with i to the
-- right and j upwards.
function obj:grid(nx, ny, corner_at)
    for j = 0, ny - 1 do
        for i = 0, nx - 1 do
            self:face(corner_at(i, j), corner_at(i + 1, j), corner_at(i + 1, j + 1), corner_at(i, j + 1))
        end
    end
end

function obj:write(path)
    local file = assert(io.open(path, "w"))
    file:write("# ", self.comment, "\n")
    for _, kind in ipairs { "v", "vt", "vn" } do
        for _, line in ipairs(self.lists[kind]) do
            file:write(line, "\n")
        end
    end
    file:write(table.concat(self.faces, "\n"), "\n")
    file:close()
end

return obj
