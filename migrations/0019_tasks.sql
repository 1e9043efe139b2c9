-- Parts of running jobs that workers compute. A lease is the task's attempt with its secret, of
-- which the digest is kept, and when it expires. A result is written once, in the transaction that
-- ends the task; lost counts the attempts that ended without one, and reasons says how. What a task
-- is to compute is made anew by the job where the daemon starts again: its id names that.
CREATE TABLE task (
    id         TEXT PRIMARY KEY NOT NULL,
    job        TEXT NOT NULL REFERENCES job (id) ON DELETE CASCADE,
    kind       TEXT NOT NULL,
    status     TEXT NOT NULL CHECK (status IN ('waiting', 'leased', 'done')),
    attempt    INTEGER NOT NULL DEFAULT 0 CHECK (attempt >= 0),
    lost       INTEGER NOT NULL DEFAULT 0 CHECK (lost >= 0),
    secret     TEXT NOT NULL DEFAULT '',
    worker     TEXT NOT NULL DEFAULT '',
    expires_ms INTEGER NOT NULL DEFAULT 0,
    reasons    TEXT NOT NULL DEFAULT '',
    result     BLOB,
    CHECK ((status = 'done') = (result IS NOT NULL))
) STRICT;
CREATE INDEX task_by_job ON task (job);

-- A job that has ended has no tasks: what workers still compute of it is refused.
CREATE TRIGGER task_ends AFTER UPDATE OF status ON job
WHEN new.status NOT IN ('accepted', 'running')
BEGIN
    DELETE FROM task WHERE job = new.id;
END;
