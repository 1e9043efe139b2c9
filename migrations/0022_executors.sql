-- Who has computed the tasks of a job: how many results came of each host, with the kind of its
-- processor and its build. Counted in the transaction that takes the result, it outlives the tasks
-- and goes with the job.
CREATE TABLE executor (
    job   TEXT NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    host  TEXT NOT NULL,
    cpu   TEXT NOT NULL,
    build TEXT NOT NULL,
    tasks INTEGER NOT NULL CHECK (tasks > 0),
    PRIMARY KEY (job, host, cpu, build)
) STRICT, WITHOUT ROWID;

-- Where the lease is, for what is said of an attempt that is lost.
ALTER TABLE task ADD COLUMN place TEXT NOT NULL DEFAULT '';
