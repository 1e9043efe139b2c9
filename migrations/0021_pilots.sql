-- Arrays of workers ("pilots") that Slurm was asked for. The row is written before sbatch runs, with
-- the name by which Slurm will know the array, so that a daemon that was killed meanwhile finds it
-- again; the number that Slurm gives comes afterwards. token is the digest of what the pilots prove
-- themselves by. Rows outlive their job: they go when Slurm no longer has the array.
CREATE TABLE pilots (
    name       TEXT PRIMARY KEY NOT NULL,
    job        TEXT NOT NULL,
    number     TEXT NOT NULL DEFAULT '',
    status     TEXT NOT NULL CHECK (status IN ('intended', 'submitted', 'ending')),
    try        INTEGER NOT NULL CHECK (try > 0),
    size       INTEGER NOT NULL CHECK (size > 0),
    memory     INTEGER NOT NULL DEFAULT 0 CHECK (memory >= 0),
    token      TEXT NOT NULL
) STRICT;
