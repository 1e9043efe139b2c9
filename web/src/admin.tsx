// For admins: who may call and what each holds, the queue, the storage, what is ready, and versions.
import { useEffect } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { link } from './router';
import { caller, useValue } from './state';
import { Page, ProblemBox, Shown, figure, plural, size, span, useLoad, when } from './ui';
import { Workers } from './workers';

/** Sums of series of /metrics, by name, and by one label where that is asked for. */
export function readMetrics(text: string): { sum: (name: string, label?: string, value?: string) => number; by: (name: string, label: string) => [string, number][] } {
    const rows = [...text.matchAll(/^([a-z_]+)(?:\{(.*)\})? ([0-9.eE+-]+)$/gm)].map(([, name, labels, value]) => ({
        name, value: Number(value), labels: Object.fromEntries([...(labels ?? '').matchAll(/([a-z_]+)="((?:[^"\\]|\\.)*)"/g)].map(([, l, v]) => [l, v])),
    }));
    return {
        sum: (name, label, value) => rows.filter((r) => r.name === name && (!label || r.labels[label] === value)).reduce((total, r) => total + r.value, 0),
        by: (name, label) => {
            const found = new Map<string, number>();
            for (const r of rows) if (r.name === name) found.set(r.labels[label] ?? '', (found.get(r.labels[label] ?? '') ?? 0) + r.value);
            return [...found];
        },
    };
}

const REFRESH_MS = 5000;
const limit = (n: number | undefined, text: (n: number) => string): string => (n ? text(n) : t`no limit`);

function Users() {
    const users = useLoad((signal) => api.get('/v1/users', {}, signal), []);
    return (
        <section aria-label={t`Users`}>
            <h2>{t`Users`}</h2>
            <Shown of={users} label={t`users`}>{({ items }) => (items.length === 0
                ? <p class="quiet">{t`This service asks for no token: whoever reaches it may do everything.`} <code>srnfd token add</code> {t`makes the first user.`}</p>
                : <div class="scroll" tabIndex={0} role="region" aria-label={t`Users`}><table>
                    <thead><tr>{[t`Name`, t`Roles`, t`Holds`, t`Of`, t`Waiting`, t`Running`, t`Requests a second`, t`Last seen`, t`Tokens`].map((title) => <th scope="col">{title}</th>)}</tr></thead>
                    <tbody>{items.map((u) => {
                        const quotas = u.tokens[0]?.quotas ?? {};
                        const last = u.tokens.map((one) => one.lastUsed ?? '').sort().at(-1);
                        return (
                            <tr><td>{u.name}</td><td>{[...new Set(u.tokens.map((one) => one.role))].join(', ')}</td><td>{size(u.bytes)}</td><td>{limit(quotas.bytes, size)}</td>
                                <td>{t`${u.jobsWaiting} of ${limit(quotas.queued, String)}`}</td><td>{t`${u.jobsRunning} of ${limit(quotas.running, String)}`}</td>
                                <td>{limit(quotas.requests, String)}</td><td>{last ? when(last) : t`not known`}</td>
                                <td>{u.tokens.map((one) => <div><code>{one.id}</code>{one.expires ? t` until ${when(one.expires)}` : ''}</div>)}</td></tr>
                        );
                    })}</tbody></table></div>)}</Shown>
            <p class="quiet">{t`Tokens are made and revoked where the service runs:`} <code>srnfd token add --name NAME</code>, <code>srnfd token revoke ID</code>.</p>
        </section>
    );
}

export function Admin() {
    const who = useValue(caller);
    const state = useLoad(async (signal) => {
        const [metrics, ready, version] = await Promise.all([
            api.request('/metrics', { signal }).then((r) => r.text()), api.get('/readyz', {}, signal).then(() => null, (e: unknown) => e), api.get('/v1/version', {}, signal),
        ]);
        return { metrics: readMetrics(metrics), ready, version };
    }, []);
    useEffect(() => {
        const timer = setInterval(state.reload, REFRESH_MS);
        return () => clearInterval(timer);
    }, []);
    if (who && who.tokens && who.role !== 'admin') return <Page title={t`Administration`}><p>{t`This page is for tokens of the role admin; yours is ${who.role}.`}</p></Page>;
    return (
        <Page title={t`Administration`}>
            <Shown of={state} label={t`the state of the service`}>{({ metrics, ready, version }) => (
                <>
                    <section aria-label={t`Readiness`}>
                        <h2>{ready ? t`Not ready` : t`Ready`}</h2>
                        {ready ? <ProblemBox error={ready} /> : <p class="quiet">{t`Uploads and analyses are taken.`}</p>}
                    </section>
                    <section aria-label={t`Queue`}>
                        <h2>{t`Queue`}</h2>
                        <dl class="pairs">
                            <dt>{t`Waiting`}</dt><dd>{plural(metrics.sum('srnfd_queue_length'), 'job')}{metrics.sum('srnfd_queue_age_seconds') > 1 ? t`, the oldest for ${span(metrics.sum('srnfd_queue_age_seconds'))}` : ''}</dd>
                            <dt>{t`Workers busy`}</dt><dd>{t`${metrics.sum('srnfd_workers_busy')} of ${metrics.sum('srnfd_workers')}, for short jobs ${metrics.sum('srnfd_express_workers_busy')} of ${metrics.sum('srnfd_express_workers')}`}</dd>
                            <dt>{t`Memory of jobs`}</dt><dd>{t`${size(metrics.sum('srnfd_job_memory_bytes'))}; each may have ${size(metrics.sum('srnfd_job_memory_limit_bytes'))}`}</dd>
                            <dt>{t`Ended since the start`}</dt><dd>{metrics.by('srnfd_jobs_ended_total', 'status').map(([status, n]) => `${status} ${figure(n, 6)}`).join(', ') || t`none`} <a href={link('jobs')}>{t`Jobs`}</a></dd>
                        </dl>
                    </section>
                    <section aria-label={t`Storage`}>
                        <h2>{t`Storage`}</h2>
                        <dl class="pairs">
                            {metrics.by('srnfd_store_bytes', 'part').map(([part, n]) => <><dt>{part}</dt><dd>{size(n)}</dd></>)}
                            <dt>{t`Free on the disk`}</dt><dd>{size(metrics.sum('srnfd_store_free_bytes'))}</dd>
                        </dl>
                    </section>
                    <section aria-label={t`Versions`}>
                        <h2>{t`Versions`}</h2>
                        <p>{t`srnfd ${version.version}`}</p>
                        <dl class="pairs">{Object.entries(version.versions ?? {}).map(([name, text]) => <><dt>{name}</dt><dd>{`${text}`}</dd></>)}</dl>
                    </section>
                </>
            )}</Shown>
            <Workers />
            <Users />
        </Page>
    );
}
