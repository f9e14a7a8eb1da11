"""Explorer: a local web page that shows how a block rocks, chatters, comes to rest and overturns.

`parameters` specifies the inputs of a case. `inputs` reads them from texts, and `code` writes them as Python and as a
command. `core` computes arrays and words for a case, `maps` for grids of cases. Both are independent of the web.
`server` checks and answers requests without any mechanics; `launch` starts it. The page itself is in `page/`.
"""
