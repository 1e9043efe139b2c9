-- Lists of jobs are filtered by how long they ran, too: read from the index like the rest.
DROP INDEX job_by_owner;
CREATE INDEX job_by_owner ON job (owner, created_ms, id, process, status, title, cohort, started_ms,
                                  finished_ms);
DROP INDEX job_by_time;
CREATE INDEX job_by_time ON job (created_ms, id, process, status, title, cohort, started_ms, finished_ms);
