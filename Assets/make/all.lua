-- Makes every generated mesh and texture of the scenes: lua5.4 Assets/make/all.lua
local here = arg[0]:match("^(.*/)") or ""
for _, script in ipairs { "textures", "roofs", "phoenix", "land" } do
    dofile(here .. script .. ".lua")
end
