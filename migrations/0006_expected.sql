-- How long a job is expected to take. Within its owner's turn the queue is ordered by the time at
-- which a job was created plus that time: short jobs go before long ones, and no job is overtaken
-- by those that come later than it is itself expected to take. 0 where nothing is known. express: a
-- job so short that the express worker may take it (jobs/workers.c).
ALTER TABLE job ADD COLUMN expected_ms INTEGER NOT NULL DEFAULT 0 CHECK (expected_ms >= 0);
ALTER TABLE job ADD COLUMN express INTEGER NOT NULL DEFAULT 0 CHECK (express IN (0, 1));
DROP INDEX job_waiting;
CREATE INDEX job_waiting ON job (owner, created_ms + expected_ms, id) WHERE status = 'accepted';
CREATE INDEX job_express ON job (owner, created_ms + expected_ms, id)
WHERE status = 'accepted' AND express = 1;
