-- What the temple and its surroundings are made of. A look is a material, or a table of a material and a picture.
local gold = gr.material({ 0.95, 0.66, 0.20 }, { 0.45, 0.40, 0.20 }, 30)
local wood = gr.material({ 0.40, 0.23, 0.13 }, { 0.10, 0.08, 0.06 }, 15)
local dull = gr.material({ 0.50, 0.47, 0.43 }, { 0.03, 0.03, 0.03 }, 5)

return {
    gold = gold,
    gold_leaf = { gold, "gold_leaf.png" },
    dark_gold = gr.material({ 0.66, 0.42, 0.12 }, { 0.35, 0.28, 0.12 }, 25),
    bronze = gr.material({ 0.90, 0.62, 0.16 }, { 0.70, 0.62, 0.35 }, 40),

    wood = wood,
    grained_wood = { wood, "wood.png" },
    dark_wood = gr.material({ 0.20, 0.11, 0.07 }, { 0.10, 0.08, 0.06 }, 15),
    bark = { wood, "bark.png" },
    bamboo = gr.material({ 0.74, 0.56, 0.28 }, { 0.20, 0.18, 0.10 }, 20),
    plaster = gr.material({ 0.82, 0.78, 0.70 }, { 0.05, 0.05, 0.05 }, 5),
    paper = gr.material({ 0.92, 0.84, 0.66 }, { 0.05, 0.05, 0.05 }, 5),
    lacquer = gr.material({ 0.68, 0.12, 0.08 }, { 0.35, 0.25, 0.20 }, 30),

    roof = gr.material({ 0.17, 0.15, 0.19 }, { 0.15, 0.15, 0.18 }, 15),
    tiles = {
        gr.material({ 0.33, 0.29, 0.36 }, { 0.30, 0.30, 0.34 }, 25),
        gr.material({ 0.29, 0.26, 0.34 }, { 0.30, 0.30, 0.34 }, 25),
        gr.material({ 0.36, 0.30, 0.34 }, { 0.30, 0.30, 0.34 }, 25),
    },

    stone = dull,
    stones = { dull, "stones.png" },
    rock = { dull, "rock.png" },
    moss = { dull, "moss.png" },
    near_mountain = { dull, "autumn_mountain.png" },
    far_mountain = { dull, "far_mountain.png" },
    water = { gr.reflective_material({ 0.10, 0.35, 0.55 }, { 0.20, 0.20, 0.22 }, 60, 0.72), "lake.png" },

    forest = {
        gr.material({ 0.10, 0.20, 0.09 }, { 0, 0, 0 }, 1), gr.material({ 0.15, 0.25, 0.08 }, { 0, 0, 0 }, 1),
        gr.material({ 0.22, 0.24, 0.08 }, { 0, 0, 0 }, 1), gr.material({ 0.36, 0.21, 0.07 }, { 0, 0, 0 }, 1),
        gr.material({ 0.33, 0.11, 0.06 }, { 0, 0, 0 }, 1),
    },
    green_leaf = gr.material({ 0.20, 0.34, 0.10 }, { 0.05, 0.06, 0.04 }, 8),
    amber_leaf = gr.material({ 0.66, 0.38, 0.08 }, { 0.08, 0.06, 0.04 }, 8),
    red_leaf = gr.material({ 0.80, 0.17, 0.07 }, { 0.15, 0.08, 0.05 }, 10),
}
