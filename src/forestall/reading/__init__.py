"""Everything that is read passes here: files of others become plain values, or one sentence.

Called by every reader; calls errors only. `files` opens (size, no path outside a folder),
`documents` parses JSON and TOML (size, count, depth, numbers, characters, keys given twice),
`fields` and `models` make typed values of what was parsed and say where in it something is wrong,
`arrays`, `pictures` and `pickles` read .npy, .npz, images and pickles within their budgets and run
nothing, `printing` takes escapes out of what is shown on a terminal. What is wrong is a
`FileFormatError`.
"""
