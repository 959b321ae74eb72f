-- What Pandoc's reStructuredText lacks of Sphinx: numbers of figures, tables and equations, and formulas in emphasis.

local ROLES = { fig = "numref", tab = "numref", sec = "ref", eq = "eq" }
local THEOREMS = { prop = "proposition", cor = "corollary" }

function Link(link)
  local kind, name = link.target:match("^#(%a+):(.+)$")
  if ROLES[kind] then
    return pandoc.RawInline("rst", ":" .. ROLES[kind] .. ":`" .. kind .. ":" .. name .. "`")
  elseif THEOREMS[kind] then
    link.content:insert(1, pandoc.Str(THEOREMS[kind] .. " "))
    return link
  end
end

function Math(formula)
  formula.text = formula.text:gsub("\\ensuremath", "")
  return formula
end

function Emph(words)
  local plain = true
  words:walk({ Math = function() plain = false end })
  return plain and words or words.content
end

local function named(block, identifier, options)
  local text = pandoc.write(pandoc.Pandoc(block), "rst", { wrap_text = "none" })
  text = text:gsub("\n   :?name: [^\n]*", "")
  text = text:gsub("(%.%. %a+::[^\n]*\n)", "%1   :name: " .. identifier .. "\n" .. (options or ""), 1)
  return pandoc.RawBlock("rst", text .. "\n")
end

function Figure(figure)
  local words = pandoc.utils.stringify(figure.caption.long):gsub("\\frac{(.-)}{(.-)}", "%1/%2")
  words = words:gsub("(%w)\\", "%1 \\"):gsub("\\(%a+)(%d)", "\\%1 %2"):gsub("\\,", " ")
  words = words:gsub("[\\{}]", ""):gsub("%s+", " "):gsub("%%", "%%%%")
  return named({ figure }, figure.identifier, "   :alt: " .. words .. "\n")
end

function Div(block)
  if block.identifier:match("^tab:") then
    return named(block.content, block.identifier)
  end
end
