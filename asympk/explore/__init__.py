"""``asympk explore``: a page in the browser on which one drags the start of a scene and changes its parameters.

    choice -> knobs (ranges of numbers) -> motion, surroundings -> questions -> worker (a process) -> server -> page/

The server listens on this machine only, reads no files after its start, and answers only requests with its token.
"""
