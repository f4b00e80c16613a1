local function make()
  return gr.sphere(), nil
end
make()
