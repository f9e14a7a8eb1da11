"""The explorer: a local page on which a block is seen to rock, chatter, rest and fall.

`parameters` specifies what a case can be given; `inputs` reads it from texts and writes it as Python and as a command;
`core` makes arrays and words of it, `maps` grids of many; they know no web. `server` answers requests and knows no
mechanics; `authentication` checks each request before; `launch` starts them. The page itself is in `page/`.
"""
