"""The explorer: a local page on which a block is seen to rock, chatter, rest and fall.

`case` reads a case from texts and writes it as Python and as a command; `core` makes arrays and words of it, `maps`
grids of many; they know no web. `server` answers requests and knows no mechanics; `guard` stands before it; `launch`
and `notebook` start it. The page itself is in `page/`.
"""
