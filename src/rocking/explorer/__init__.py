"""Explorer: a local web page that shows how a block rocks, chatters, comes to rest and overturns.

`parameters` specifies the inputs of a case. `inputs` reads them from texts, and `code` writes them as Python and as a
command. `core` computes arrays and words for a case, `maps` for grids of cases. Both are independent of the web.
`server` answers requests without any mechanics; `authentication` checks each request first; `launch` starts them. The
page itself is in `page/`.
"""
