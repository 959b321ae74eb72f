"""``asympk explore``: a page on which one drags a start, turns parameters, and sees the motion at once.

    choice -> knobs (what can be turned) -> motion, surroundings -> questions -> worker (a process) -> server -> page/

The server listens on this machine alone, reads no files once it runs, and answers only who has the token.
"""
