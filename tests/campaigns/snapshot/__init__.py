"""Every public answer of a tree, written to files and compared bit by bit with another tree's.

For a change that must not change any answer::

    python -m tests.campaigns.snapshot write FOLDER               # a minute and a half
    python -m tests.campaigns.snapshot write FOLDER --all         # the paper too, one minute more
    python -m tests.campaigns.snapshot write FOLDER --only plans cli
    python -m tests.campaigns.snapshot write FOLDER --tree TREE   # of a checkout elsewhere
    python -m tests.campaigns.snapshot compare FOLDER_A FOLDER_B  # exit code 1 if they differ
    python -m tests.campaigns.snapshot compare FOLDER_A FOLDER_B --tolerance 1e-10

Every job writes JOB.npz, its arrays, and JOB.json, all else as text. A name tells how a value was
reached, such as ``pose1/least/K.joint``. Only public names are used, so that it runs on trees whose
files have moved; module paths, addresses, folders and times are taken out of texts. An object that
a job meets again is told as ``same as`` the first name, so sharing counts. To add a kind of answer,
yield it with a name from a function decorated with ``@job``.
"""
