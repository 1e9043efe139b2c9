-- How often the daemon has died while it ran a job. That says little about the job: what ended the
-- daemon may have been a request, another job or a power failure. So the job is put back, and after a
-- few deaths it runs alone, with no other job beside it (jobs/alone.c). A daemon that dies then dies
-- of it.
ALTER TABLE job ADD COLUMN deaths INTEGER NOT NULL DEFAULT 0 CHECK (deaths >= 0);
ALTER TABLE job ADD COLUMN alone INTEGER NOT NULL DEFAULT 0 CHECK (alone IN (0, 1));
CREATE INDEX job_alone ON job (owner, created_ms + expected_ms, id)
WHERE status = 'accepted' AND alone = 1;
