-- Draws one storey of the temple from `eye`; `middle` is the height that the picture is centred on.
return function(file, storey, eye, fov, middle)
    local scene = gr.node("scene")
    scene:add_child(storey)
    scene:rotate("y", -34)

    local sun = gr.light({ -40, 110, 300 }, { 0.80, 0.70, 0.55 }, { 1, 0, 0 })
    local sky = gr.light({ 220, 120, 160 }, { 0.22, 0.20, 0.26 }, { 1, 0, 0 })

    gr.render(scene, file, 512, 512, eye, { -eye[1], middle - eye[2], -eye[3] }, { 0, 1, 0 }, fov, { 0.34, 0.32, 0.36 },
        { sun, sky })
end
