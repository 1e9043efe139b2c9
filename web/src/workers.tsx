// For admins: the processes of `srnfd worker`, on this and other machines, that compute tasks of jobs, and those that get
// none since a result of theirs was wrong.
import { useEffect, useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { say } from './state';
import { ProblemBox, Shown, Sure, plural, useLoad, when } from './ui';

const REFRESH_MS = 5000;

type Bar = api.Answer<'/v1/workers'>['bars'][number];

function Bars({ bars, reload }: { bars: Bar[]; reload: () => void }) {
    const [error, setError] = useState<unknown>();
    const lift = async (bar: Bar) => {
        setError(undefined);
        try {
            await api.send('delete', '/v1/workers/bars/{bar}', { bar: `${bar.bar}` });
            say(t`${bar.worker} gets tasks again`);
            reload();
        } catch (e) {
            setError(e);
        }
    };
    return (
        <>
            <h3>{t`Barred`}</h3>
            <p class="quiet">{t`The service computed other results than these returned. All that come with the token from the host get no tasks for a day, and what they had returned is computed again.`}</p>
            {error ? <ProblemBox error={error} /> : null}
            <div class="scroll" tabIndex={0} role="region" aria-label={t`Barred workers`}><table>
                <thead><tr>{[t`Found wrong`, t`Host`, t`Token`, t`Why`, t`Since`, t`Until`].map((title) => <th scope="col">{title}</th>)}<th scope="col"><span class="sr">{t`Lift`}</span></th></tr></thead>
                <tbody>{bars.map((b) => (
                    <tr key={b.bar}><td><code>{b.worker}</code></td><td>{b.host || t`any`}</td><td>{b.pilots ? t`of the service, for pilots` : b.token || t`none`}</td><td>{b.why}</td>
                        <td>{when(b.since)}</td><td>{when(b.until)}</td>
                        <td><Sure onYes={() => void lift(b)} question={t`Let workers from ${b.host || t`any host`} have tasks again?`}>{t`Lift`}</Sure></td></tr>
                ))}</tbody></table></div>
        </>
    );
}

export function Workers() {
    const workers = useLoad((signal) => api.get('/v1/workers', {}, signal), []);
    useEffect(() => {
        const timer = setInterval(workers.reload, REFRESH_MS);
        return () => clearInterval(timer);
    }, []);
    return (
        <section aria-label={t`Workers`}>
            <h2>{t`Workers`}</h2>
            <Shown of={workers} label={t`workers`}>{({ executor, items, bars }) => {
                const slots = items.reduce((sum, w) => sum + w.slots, 0);
                const leased = items.reduce((sum, w) => sum + w.leased, 0);
                if (executor === 'local') return <p class="quiet">{t`The service computes everything itself.`} <code>--executor workers</code> {t`or`} <code>slurm</code> {t`makes it offer tasks to other machines.`}</p>;
                const barred = bars.length > 0 && <Bars bars={bars} reload={workers.reload} />;
                if (items.length === 0) return <><p class="quiet">{t`No worker has given a sign for two minutes.`} {executor === 'slurm' ? t`Slurm is asked for some when a job has tasks.` : <>{t`Jobs wait until`} <code>srnfd worker</code> {t`runs somewhere.`}</>}</p>{barred}</>;
                return (
                    <>
                        <p>{t`${plural(items.length, 'worker')}${executor === 'slurm' ? t`, placed by Slurm or started by hand` : ''}: ${leased} of ${plural(slots, 'slot')} at work.`}</p>
                        <div class="scroll" tabIndex={0} role="region" aria-label={t`Workers`}><table>
                            <thead><tr>{[t`Worker`, t`Host`, t`Processor`, t`Token`, t`At work`, t`Done`, t`Lost`, t`First sign`, t`Last sign`].map((title) => <th scope="col">{title}</th>)}</tr></thead>
                            <tbody>{items.map((w) => (
                                <tr><td><code>{w.worker}</code>{!w.alive && <div class="quiet">{t`gives no sign`}</div>}{w.barred && <div class="wrong">{t`barred`}</div>}</td><td>{w.host}</td><td>{w.cpu}</td><td>{w.token || t`none`}</td><td>{t`${w.leased} of ${w.slots}`}</td>
                                    <td>{w.done}{Object.entries(w.kinds).map(([kind, of]) => <div class="quiet">{kind} {of.done}</div>)}</td>
                                    <td>{w.lost}</td><td>{when(w.first)}</td><td>{when(w.last)}</td></tr>
                            ))}</tbody></table></div>
                        {barred}
                    </>
                );
            }}</Shown>
        </section>
    );
}
