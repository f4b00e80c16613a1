-- Draws the branching tree of tree.grammar at one depth, fitted into the picture.
return function(file, depth, height)
    local trunk = gr.cylinder("trunk")
    trunk:set_material(gr.material({ 0.62, 0.42, 0.22 }, { 0.10, 0.10, 0.10 }, 10))
    local leaf = gr.sphere("leaf")
    leaf:scale(0.6, 1, 0.3)
    leaf:set_material(gr.material({ 0.30, 0.62, 0.16 }, { 0.20, 0.25, 0.15 }, 20))

    local tree = gr.tree("tree", "tree.grammar", depth, trunk, leaf)

    local sun = gr.light({ -2 * height, 3 * height, 4 * height }, { 0.80, 0.74, 0.62 }, { 1, 0, 0 })
    local sky = gr.light({ 4 * height, height, 2 * height }, { 0.20, 0.22, 0.30 }, { 1, 0, 0 })

    gr.render(tree, file, 512, 512, { 0, height / 2, 2.6 * height }, { 0, 0, -1 }, { 0, 1, 0 }, 26,
        { 0.25, 0.26, 0.28 }, { sun, sky })
end
