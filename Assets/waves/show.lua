-- Draws a golden ball over a pool with circular waves; the scenes beside this file differ in their number and period
-- (both in units of the texture coordinates, which go from 0 to 1 over the pool).
return function(file, periods, period)
    local scene = gr.node("scene")

    local ball = gr.sphere("ball")
    ball:set_material(gr.reflective_material({ 0.85, 0.62, 0.22 }, { 0.6, 0.55, 0.4 }, 40, 0.15))
    ball:translate(0, 1.5, 0)
    scene:add_child(ball)

    -- The bumps turn the normals by up to a radian; the smaller scale upwards flattens them.
    local pool = gr.mesh("pool", "pool.obj")
    pool:set_material(gr.reflective_material({ 0.08, 0.42, 0.66 }, { 0.35, 0.35, 0.35 }, 30, 0.45))
    pool:mesh_add_bumps({ 0.5, 0.5 }, periods, period)
    pool:scale(11, 4.5, 11)
    scene:add_child(pool)

    local key = gr.light({ -7, 11, 5 }, { 0.75, 0.72, 0.66 }, { 1, 0, 0 })
    local fill = gr.light({ 10, 9, 12 }, { 0.25, 0.25, 0.28 }, { 1, 0, 0 })

    gr.render(scene, file, 512, 512, { 0, 6.5, 15 }, { 0, -0.42, -1 }, { 0, 1, 0 }, 42, { 0.25, 0.26, 0.30 },
        { key, fill })
end
