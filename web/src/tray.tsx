// The jobs that wait or run, always in sight.
import { useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { link } from './router';
import { isActive, jobs, mayChange, refreshJobs, say, useValue } from './state';
import { Meter, plural, span } from './ui';

export function progressText(job: api.Job): string {
    if (job.cancelRequested) return t`is being canceled`;
    if (job.status === 'accepted') return job.queuePosition ? t`waits, number ${job.queuePosition} in the queue` : t`waits`;
    const left = job.secondsLeft !== undefined && job.secondsLeft !== null ? t`, about ${span(job.secondsLeft)} left` : '';
    return `${job.message || 'runs'}, ${Math.round(job.progress)} %${left}`;
}

export async function cancelJob(job: api.Job): Promise<void> {
    try {
        await api.cancel(job.id);
        say(t`${job.name || job.process} is being canceled`);
    } catch (error) {
        say((error as Error).message);
    }
    refreshJobs();
}

export function Tray() {
    const active = useValue(jobs).filter(isActive);
    const [open, setOpen] = useState(true);
    if (!active.length) return null;
    return (
        <section class="tray" aria-label={t`Jobs in progress`}>
            <div class="row">
                <button class="plain-button" aria-expanded={open} onClick={() => setOpen(!open)}>
                    {t`${open ? '▾' : '▸'} ${plural(active.length, 'job')} in progress`}
                </button>
                <span class="grow" />
                {mayChange() && active.length > 1 && (
                    <button onClick={() => active.forEach((j) => void cancelJob(j))}>{t`Cancel all`}</button>
                )}
            </div>
            {open && active.slice(0, 5).map((job) => (
                <div class="row job" key={job.id}>
                    <a href={link('jobs', job.id)}>{job.name || job.process}</a>
                    <Meter value={job.progress} label={t`Progress of ${job.name || job.process}`} />
                    <span class="quiet grow">{progressText(job)}</span>
                    {mayChange() && <button aria-label={t`Cancel ${job.name || job.process}`} onClick={() => void cancelJob(job)}>{t`Cancel`}</button>}
                </div>
            ))}
            {open && active.length > 5 && <a href="#/jobs">{t`and ${active.length - 5} more`}</a>}
        </section>
    );
}
