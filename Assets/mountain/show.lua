-- Draws one fractal mountain; the scenes beside this file differ only in roughness and number of subdivisions.
return function(file, roughness, subdivisions)
    local mountain = gr.fractal_mountain("mountain", { 10, 4.5, 8 }, roughness, subdivisions, 10)
    mountain:set_material(gr.material({ 1, 1, 1 }, { 0.05, 0.05, 0.05 }, 5))
    mountain:translate(-5, 0, 4)
    mountain:rotate("y", 28)

    -- Rough mountains also dip below their foot: a lake hides that.
    local lake = gr.mesh("lake", { { -1, 0, 1 }, { 1, 0, 1 }, { 1, 0, -1 }, { -1, 0, -1 } }, { { 0, 1, 2, 3 } })
    lake:set_material(gr.reflective_material({ 0.20, 0.28, 0.46 }, { 0.1, 0.1, 0.1 }, 40, 0.4))
    lake:scale(60, 1, 60)
    lake:translate(0, 0.02, 0)

    local scene = gr.node("scene")
    scene:add_child(mountain)
    scene:add_child(lake)

    local sun = gr.light({ -30, 24, 30 }, { 0.85, 0.80, 0.70 }, { 1, 0, 0 })
    local sky = gr.light({ 30, 30, 20 }, { 0.20, 0.22, 0.30 }, { 1, 0, 0 })

    gr.render(scene, file, 512, 512, { 0, 4, 22 }, { 0, -0.06, -1 }, { 0, 1, 0 }, 36, { 0.22, 0.22, 0.26 },
        { sun, sky })
end
