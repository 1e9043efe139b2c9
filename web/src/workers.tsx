// For admins: the processes of `srnfd worker`, on this and other machines, that compute tasks of jobs.
import { useEffect } from 'preact/hooks';
import * as api from './api';
import { Shown, plural, useLoad, when } from './ui';

const REFRESH_MS = 5000;

export function Workers() {
    const workers = useLoad((signal) => api.get('/v1/workers', {}, signal), []);
    useEffect(() => {
        const timer = setInterval(workers.reload, REFRESH_MS);
        return () => clearInterval(timer);
    }, []);
    return (
        <section aria-label="Workers">
            <h2>Workers</h2>
            <Shown of={workers} label="workers">{({ executor, items }) => {
                const slots = items.reduce((sum, w) => sum + w.slots, 0);
                const leased = items.reduce((sum, w) => sum + w.leased, 0);
                if (executor === 'local') return <p class="quiet">The service computes everything itself. <code>--executor workers</code> or <code>slurm</code> makes it offer tasks to other machines.</p>;
                if (items.length === 0) return <p class="quiet">No worker has given a sign for two minutes. {executor === 'slurm' ? 'Slurm is asked for some when a job has tasks.' : <>Jobs wait until <code>srnfd worker</code> runs somewhere.</>}</p>;
                return (
                    <>
                        <p>{plural(items.length, 'worker')}{executor === 'slurm' ? ', placed by Slurm or started by hand' : ''}: {leased} of {plural(slots, 'slot')} at work.</p>
                        <div class="scroll" tabIndex={0} role="region" aria-label="Workers"><table>
                            <thead><tr>{['Worker', 'Host', 'Processor', 'Token', 'At work', 'Done', 'Lost', 'First sign', 'Last sign'].map((t) => <th scope="col">{t}</th>)}</tr></thead>
                            <tbody>{items.map((w) => (
                                <tr><td><code>{w.worker}</code></td><td>{w.host}</td><td>{w.cpu}</td><td>{w.token || 'none'}</td><td>{w.leased} of {w.slots}</td>
                                    <td>{w.done}{Object.entries(w.kinds).map(([kind, of]) => <div class="quiet">{kind} {of.done}</div>)}</td>
                                    <td>{w.lost}</td><td>{when(w.first)}</td><td>{when(w.last)}</td></tr>
                            ))}</tbody></table></div>
                    </>
                );
            }}</Shown>
        </section>
    );
}
