// What analyses found, each in the form that answers its question; and the report of it.
import { useMemo, useState } from 'preact/hooks';
import type { ComponentChildren } from 'preact';
import { AnyResult } from './any_result';
import * as api from './api';
import { Confusion, Curve, DataTable, HeatMap, Intervals, Scatter, scaling } from './charts';
import { Rates } from './charts_group';
import { GROUPS } from './colours';
import { Components } from './components';
import { Findings } from './findings';
import { Groups } from './groups';
import { t, whole } from './i18n';
import { Joint, JointModel } from './joint';
import { aPlace, maybe, oneOf, useKept } from './kept';
import { Between, Registered } from './landmarks';
import { Regression } from './linear';
import { Encoded, Extracted, Inverted, Mirrored, Repaired, Sampled, Transferred, Transported } from './made';
import { LandmarksOfGroup, Mean, idsOf } from './mean';
import { Neighbours } from './neighbours';
import { Linked, Path } from './paths';
import { Delete, Rename } from './records';
import { makeReport } from './report';
import { go, link } from './router';
import { textOfPoint } from './series';
import { Shape, surfacePath } from './shape';
import { mayChange } from './state';
import { Comparisons, Together, doubtful } from './together';
import { Trajectories } from './trajectories';
import { Page, ProblemBox, Shown, errorOf, figure, plural, save, size, spread, useLoad } from './ui';
import { Within } from './within';

function Warnings({ list }: { list?: { code: string; detail: string }[] }) {
    if (!list?.length) return null;
    // Fifty poor encodings are one reason: what was found is not to be below all of them.
    const kinds = new Map<string, string[]>();
    for (const { code, detail } of list) kinds.set(code, [...(kinds.get(code) ?? []), detail]);
    return (
        <section class="warning" aria-label={t`Warnings`}>
            <strong>{t`Reasons to doubt`}</strong>
            <ul>{[...kinds].map(([code, [first, ...others]]) => (
                <li><code>{code}</code> {first}
                    {others.length > 0 && <details><summary>{t`${others.length} more of this kind`}</summary><ul>{others.map((detail) => <li>{detail}</li>)}</ul></details>}
                </li>
            ))}</ul>
        </section>
    );
}

// ---- Models -----------------------------------------------------------------------------------------------------------

export function ModelPage({ id }: { id: string }) {
    const model = useLoad((signal) => api.get('/v1/models/{id}', { id }, signal), [id]);
    return (
        <Shown of={model} page label={t`the model`}>{(m) => (
            <Page title={m.name || m.madeFrom?.cohort || t`Model`} actions={<>
                <ReportButton title={m.name || t`Model`} id={m.madeFrom?.job} />
                <Rename kind="models" id={id} name={m.name ?? ''} done={model.reload} />
                <Delete kind="models" ids={[id]} name={m.name || m.madeFrom?.cohort || m.id} done={(kept) => kept.length || go('#/analyses')} />
            </>}>
                <p class="quiet">{t`${m.kind === 'parts' ? t`${plural(m.subjects, 'subject')}, ${plural(m.parts!.length, 'structure')} of each` : plural(m.subjects, 'shape')}, ${plural(m.components, 'component')}, degree ${m.lmax}`}</p>
                <div class="results">{m.kind === 'parts' ? <JointModel model={m} /> : m.kind === 'classifier' ? <AnyResult result={m} /> : <Components model={m} />}</div>
            </Page>
        )}</Shown>
    );
}

// ---- Classification ----------------------------------------------------------------------------------------------------

function Classification({ result, job }: { result: api.Outputs<'classify'>; job: api.Job }) {
    const names = Object.keys(result.methods);
    const cohort: any = result.inputs?.cohort ?? job.inputs?.cohort ?? {};
    const [method, setMethod] = useKept('method', names[0], oneOf(names));
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(oneOf(cohort.surfaces ?? [])));
    const m = result.methods[method];
    const missed = m.perSubject.filter((s: any) => s.predicted !== s.label);
    const idOf = (subject: string, label: string): string | undefined => {
        // Without subjects in the cohort each member is its own, in their order.
        if (cohort.surfaces?.length === m.perSubject.length) return cohort.surfaces[m.perSubject.findIndex((s: any) => s.subject === subject && s.label === label)];
        const subjects: string[] = cohort.subjects ?? [];
        const i = subjects.findIndex((s, k) => s === subject && (!cohort.labels || cohort.labels[k] === label));
        return cohort.surfaces?.[i];
    };
    const percent = (v: number) => `${figure(100 * v)} %`;
    return (
        <>
            <p class="big">{t`${m.correct} of ${m.perSubject.length} right`} <span class="quiet">{method}: {percent(m.accuracy)} (95 %: {m.confidenceInterval.map((v: number) => figure(100 * v)).join(' to ')} %){typeof m.pValue === 'number' ? t`, ${m.pValueIsFloor ? 'p ≤ ' : 'p = '}${figure(m.pValue)}${errorOf(m.pValueInterval)} by ${result.exact ? t`all relabellings` : t`${whole(result.permutations ?? 0)} permutations`}` : ''}</span></p>
            <p class="quiet">{t`Always the most frequent label: ${percent(result.majorityRate)}. ${result.features?.length ? t`Beside shape count: ${result.features.join(', ')}.` : t`Nothing counts but the shapes.`}${typeof m.pValue === 'number' ? '' : t` No p was asked for: run it again with permutations to have one.`}`}</p>
            <div class="split">
                <Intervals chance={Math.max(result.chance, result.majorityRate)} rows={names.map((name) => {
                    const r = result.methods[name];
                    return { name, value: r.accuracy, low: r.confidenceInterval[0], high: r.confidenceInterval[1], p: r.pValue };
                })} />
                <Rates of={m} chance={Math.max(result.chance, result.majorityRate)} title={method} name={`rates-${method}`} />
                <div>
                    <label class="no-report">{t`Method`} <select value={method} onChange={(e) => setMethod(e.currentTarget.value)}>{names.map((n) => <option>{n}</option>)}</select></label>
                    <Confusion classes={result.classes} counts={m.confusion} title={t`${method}: ${m.correct} of ${m.perSubject.length} right`} />
                </div>
            </div>
            <h2>{t`Missed: ${missed.length}`}</h2>
            <div class="split">
                <div class="scroll" tabIndex={0} role="region" aria-label={t`Members that were missed`}><table><thead><tr><th scope="col">{t`Subject`}</th><th scope="col">{t`Is`}</th><th scope="col">{t`Taken for`}</th></tr></thead>
                    <tbody>{missed.map((s: any) => {
                        const id = idOf(s.subject, s.label);
                        return <tr><td>{id ? <button class="plain-button" onClick={() => setChosen(id)}>{s.subject}</button> : s.subject}</td><td>{s.label}</td><td>{s.predicted}</td></tr>;
                    })}</tbody></table></div>
                {chosen && <Linked id={chosen} title={t`The member that was missed`} />}
            </div>
            <Comparisons list={result.comparisons} />
        </>
    );
}

// ---- Distances ---------------------------------------------------------------------------------------------------------

const isWhole = (matrix: (number | null)[][]): matrix is number[][] => matrix.every((row) => row.every((d) => d !== null));

function Distances({ result, job }: { result: api.Outputs<'distances'>; job: api.Job }) {
    if (!isWhole(result.matrix)) return <DataTable rows={[['', ...result.labels], ...result.matrix.map((row, i) => [result.labels[i], ...row])]} />;
    return <WholeDistances result={result} matrix={result.matrix} job={job} />;
}

function WholeDistances({ result, matrix, job }: { result: api.Outputs<'distances'>; matrix: number[][]; job: api.Job }) {
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(matrix.length)));
    const { points, share } = useMemo(() => scaling(matrix), [matrix]);
    const ids: string[] = result.inputs?.cohort?.surfaces ?? result.inputs?.surfaces ?? job.inputs?.surfaces ?? [];
    const near = chosen === undefined ? [] : matrix[chosen].map((d, i) => ({ d, i })).filter((e) => e.i !== chosen).sort((a, b) => a.d - b.d).slice(0, 5);
    return (
        <>
            <div class="split">
                <HeatMap labels={result.labels} matrix={matrix} chosen={chosen} onChoose={setChosen} />
                <Scatter equal title={t`Classical scaling: ${Math.round(100 * share)} % in two dimensions`} name="scaling" labels={[t`first`, t`second`]} chosen={chosen} onChoose={setChosen}
                    dots={points.map(([x, y], i) => ({ x, y, name: result.labels[i], group: result.groups?.[i] }))} />
            </div>
            {chosen !== undefined && (
                <div class="split">
                    {ids[chosen] && <Linked id={ids[chosen]} title={result.labels[chosen]} />}
                    <div><h2>{t`Nearest to ${result.labels[chosen]}`}</h2>
                        <ol>{near.map((e) => <li><button class="plain-button" onClick={() => setChosen(e.i)}>{result.labels[e.i]}</button> {figure(e.d)}</li>)}</ol></div>
                </div>
            )}
        </>
    );
}

// ---- Classifiers -------------------------------------------------------------------------------------------------------

function Trained({ result }: { result: api.Outputs<'train'> | api.Outputs<'train-parts'> }) {
    const missed = result.perSubject.filter((s: any) => s.predicted !== s.label);
    const parts: any[] | undefined = 'parts' in result ? result.parts : undefined;
    return (
        <>
            <p class="big">{t`${result.validation.correct} of ${plural(result.validation.members, parts ? 'subject' : 'member')} right, each without its subject.`}</p>
            <p class="quiet">{result.features?.length ? t`Beside shape count: ${result.features.join(', ')}.` : t`Nothing counts but the shapes.`}</p>
            {parts && <p class="quiet">{t`By ${plural(parts.length, 'structure')} together: ${parts.map((part) => t`${part.name} (weight ${figure(part.weight)})`).join(', ')}.`}</p>}
            <Findings result={result} />
            <h2>{t`Missed: ${missed.length}`}</h2>
            <DataTable rows={[[t`subject`, t`is`, t`taken for`, ...result.classes.map((c: string) => t`probability of ${c}`)],
                ...missed.map((s: any) => [s.subject, s.label, s.predicted, ...result.classes.map((c: string) => s.probabilities[c])])]} />
            {mayChange() && <div class="actions no-report"><a class="button" href={`${link('analyses', 'predict')}?model=${result.model.id}`}>{t`A new subject`}</a></div>}
        </>
    );
}

function Predicted({ result }: { result: api.Outputs<'predict'> }) {
    const [chosen, setChosen] = useKept('chosen', 0, aPlace(result.predictions.length));
    const one = result.predictions[chosen];
    const far = doubtful(one.typicality);
    return (
        <>
            <div class="split">
                <div class="scroll" tabIndex={0} role="region" aria-label={t`Predictions`}><table>
                    <thead><tr><th scope="col">{t`Subject`}</th><th scope="col">{t`Label`}</th>{result.classes.map((c: string) => <th scope="col">{c}</th>)}<th scope="col">{t`Unlike all by`}</th></tr></thead>
                    <tbody>{result.predictions.map((p: any, i: number) => (
                        <tr><td><button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{p.subject}</button></td><td>{p.label}</td>
                            {result.classes.map((c: string) => <td>{figure(100 * p.probabilities[c])} %</td>)}<td>{doubtful(p.typicality) || '–'}</td></tr>
                    ))}</tbody>
                </table></div>
                <div>
                    {one.parts ? <div class="gallery">{one.parts.map((part: any, k: number) => <Linked key={part.surface} id={part.surface} title={`${one.subject}, ${part.name}: ${one.label}`} colour={GROUPS[k % GROUPS.length]} />)}</div>
                        : <Linked id={one.surface} title={`${one.subject}: ${one.label}`} />}
                    {far ? <p class="wrong">{t`It is unlike the members of every class (${far}): its label and its probabilities say nothing.`}</p>
                        : <p>{t`Probability of ${one.label}: ${figure(100 * one.probabilities[one.label])} %, against ${figure(100 * result.priors[one.label])} % before it was seen.`}</p>}
                </div>
            </div>
            {one.parts && <DataTable rows={[[t`structure`, t`distance from the mean`, t`beyond the model`], ...one.parts.map((part: any) => [part.name, part.distance, part.residual]),
                ...('position' in one && one.position ? [[t`where they are`, one.position.distance, one.position.residual]] : [])]} />}
            <Findings result={result} />
        </>
    );
}

// ---- Beside the norm ---------------------------------------------------------------------------------------------------

/** What each structure has in how odd a subject is, and where it is odd. */
function ScoredParts({ parts, position }: { parts: any[]; position: any }) {
    const [chosen, setChosen] = useKept('structure', 0, aPlace(parts.length));
    const part = parts[chosen];
    return (
        <>
            <DataTable rows={[[t`structure`, t`distance from the mean`, t`beyond the model`, t`share of the Mahalanobis distance`, t`largest |z|`, t`p of that`],
                ...parts.map((p) => [p.name, p.distance, p.residual, p.mahalanobisShare, p.largestZ?.value, p.largestZ?.pValue]),
                ...(position ? [[t`where they are`, position.distance, position.residual, position.mahalanobisShare, null, null]] : [])]} />
            <label class="no-report">{t`Structure`} <select value={chosen} onChange={(e) => setChosen(+e.currentTarget.value)}>{parts.map((p, k) => <option value={k}>{p.name}</option>)}</select></label>
            {part.zMap ? <Shape key={part.zMap.id} src={surfacePath(part.zMap.id, 32)} label={t`${part.name} with its z map`} name={`z-map-${chosen}`} first="zScore" />
                : <p class="quiet">{t`No map was asked for.`}</p>}
        </>
    );
}

function Scored({ result }: { result: api.Outputs<'score'> }) {
    const { zMap, calibration } = result;
    return (
        <>
            <p class="big">{t`Percentile ${figure(result.percentile)}`} <span class="quiet">{t`(${result.percentileInterval?.map((v: number) => figure(v)).join(' to ')}, beside ${plural(result.subjects, 'subject')}; ${plural(result.asOdd, 'of them is', 'of them are')} as odd)`}</span></p>
            <p>{t`p = ${figure(result.pValue)}. Mahalanobis distance ${figure(result.mahalanobis)} in ${plural(result.components, 'component')}, ${figure(result.residual)} from their space.${result.at ? t` Expected for ${textOfPoint(result.at)}.` : ''}${result.trainingSubject ? t` It is a member of the model, and was left out.` : ''}`}</p>
            <DataTable rows={[[t`what`, t`value`, t`percentile`, t`95 % from`, t`to`, 'p'],
                ...Object.entries<any>(result.ranks ?? {}).map(([name, rank]) => [api.words(name), rank.value, rank.percentile, rank.interval?.[0] ?? null, rank.interval?.[1] ?? null, rank.pValue])]} />
            {result.parts ? <ScoredParts parts={result.parts} position={result.position} />
                : zMap ? <Shape src={surfacePath(zMap.id, 32)} label={t`The surface with its z map`} name="z-map" first="zScore" /> : <p class="quiet">{t`No map was asked for.`}</p>}
            {calibration && <p class="quiet">{t`Percentiles of ${plural(calibration.subjects, 'subject')} that were left out differ from uniform ones by ${figure(calibration.overall?.distance)} (p = ${figure(calibration.overall?.pValue)}).`}</p>}
            <Findings result={result} />
        </>
    );
}

function Written({ result, job }: { result: api.Outputs<'report'>; job: api.Job }) {
    const title = result.inputs?.title ?? job.name;
    return (
        <>
            <p class="big">{title}</p>
            <p>{plural(result.sections.length, 'section')}, {plural(result.shapes, 'shape')}, {size(result.bytes)}.</p>
            <ul>{result.sections.map((s: any) => <li><a href={link('jobs', s.job)}>{s.name || s.process}</a></li>)}</ul>
            <button class="main" onClick={() => save(`${title.replace(/[^A-Za-z0-9._-]+/g, '-')}.html`, result.html, 'text/html;charset=utf-8')}>{t`Save the report`}</button>
        </>
    );
}

function Quality({ result }: { result: api.Outputs<'evaluate-model'> }) {
    const curve = (name: 'generalisation' | 'specificity' | 'compactness', title: string) => {
        const points = (result[name] ?? []).filter((p: any) => p.value !== null).map((p: any) => ({ x: p.components, y: p.value, error: p.standardError }));
        return points.length > 1 ? <Curve key={name} title={title} name={name} points={points} labels={[t`components`, name]} /> : null;
    };
    return <div class="split">{curve('generalisation', t`Generalisation: how far left-out shapes stay`)}{curve('specificity', t`Specificity: how far random shapes are from real ones`)}{curve('compactness', t`Compactness: variance so far`)}</div>;
}

/** A new subject among those of the model. */
function Projection({ result, job }: { result: api.Outputs<'project'>; job: api.Job }) {
    const id = result.inputs?.model?.id ?? result.inputs?.model ?? job.inputs?.model;
    const model = useLoad((signal) => api.get('/v1/models/{id}', { id }, signal), [id]);
    const surface = result.inputs?.surface?.id ?? result.inputs?.surface ?? job.inputs?.surface;
    return (
        <Shown of={model} label={t`the model`}>{(m) => {
            const sd = (k: number) => Math.sqrt(m.eigenvalues[k]) || 1;
            const second = Math.min(1, m.components - 1);
            const dots = m.scores.map((s, i) => ({ x: s[0] / sd(0), y: s[second] / sd(second), name: m.labels[i], group: m.groups?.[i] }));
            const [x, y] = [result.scores[0], result.scores[second]];
            if (typeof x === 'number' && typeof y === 'number') dots.push({ x: x / sd(0), y: y / sd(second), name: 'the new subject', group: 'new' });
            return (
                <div class="split">
                    <Scatter title={t`The new subject among the others`} name="projection" dots={dots} chosen={dots.length - 1} onChoose={() => {}} labels={[t`component 1 (sd)`, t`component ${second + 1} (sd)`]} />
                    <div>
                        {typeof surface === 'string' && <Linked id={surface} title={t`The new subject`} />}
                        <dl class="pairs">
                            {!result.typicality && <><dt>{t`Residual`}</dt><dd>{figure(result.residual)}</dd><dt>{t`Distance from the mean`}</dt><dd>{figure(result.distance)}</dd>
                                <dt>{t`Mahalanobis`}</dt><dd>{figure(result.mahalanobis)}</dd></>}
                            {Object.entries<any>(result.typicality ?? {}).map(([name, of]) => of && typeof of === 'object' && <><dt>{api.words(name)}</dt><dd>{t`${figure(of.value)}, percentile ${spread(of.percentile, of.percentileInterval)}, doubtful above ${figure(of.limit)}`}</dd></>)}
                        </dl>
                    </div>
                </div>
            );
        }}</Shown>
    );
}

function ReportButton({ title, job, id }: { title: string; job?: api.Job; id?: string }) {
    const [busy, setBusy] = useState(false);
    const [error, setError] = useState<unknown>();
    return (
        <>
            <button class="no-report" disabled={busy} onClick={async () => {
                setBusy(true);
                setError(undefined);
                await makeReport(title, document.querySelector<HTMLElement>('.results')!, job, id).catch(setError);
                setBusy(false);
            }}>{busy ? t`Writing the report…` : t`Report as one page`}</button>
            {error ? <ProblemBox error={error} /> : null}
        </>
    );
}

/** What shows the results of a process; of others all members are listed. */
const VIEWS: { [P in api.ProcessId]?: (result: api.Outputs<P>, job: api.Job) => ComponentChildren } = {
    extract: (result) => <Extracted result={result} />,
    encode: (result) => <Encoded result={result} />,
    repair: (result) => <Repaired result={result} />,
    mirror: (result) => <Mirrored result={result} />,
    invert: (result) => <Inverted result={result} />,
    transport: (result) => <Transported result={result} />,
    transfer: (result) => <Transferred result={result} />,
    sample: (result) => <Sampled result={result} />,
    mean: (result, job) => <Mean result={result} job={job} />,
    'classify-parts': (result) => <Together result={result} />,
    pca: (result, job) => <><Components model={result.model} /><LandmarksOfGroup result={result} surface={result.model.mean.id} ids={idsOf(result, job)} /></>,
    'compare-groups': (result) => <Groups result={result} />,
    change: (result) => <Within result={result} />,
    asymmetry: (result) => <Within result={result} />,
    classify: (result, job) => <Classification result={result} job={job} />,
    distances: (result, job) => <Distances result={result} job={job} />,
    regress: (result) => <Regression result={result} />,
    train: (result) => <Trained result={result} />,
    'train-parts': (result) => <Trained result={result} />,
    predict: (result) => <Predicted result={result} />,
    score: (result) => <Scored result={result} />,
    report: (result, job) => <Written result={result} job={job} />,
    project: (result, job) => <Projection result={result} job={job} />,
    'evaluate-model': (result) => <><Quality result={result} /><AnyResult result={{ members: result.members, subjects: result.subjects }} /></>,
    geodesic: (result, job) => <Between result={result} job={job} />,
    register: (result, job) => <Registered result={result} job={job} />,
    trajectories: (result) => <Trajectories result={result} />,
    'pca-parts': (result, job) => <Joint result={result} job={job} />,
    neighbours: (result, job) => <Neighbours result={result} job={job} />,
    modes: (result) => <Path surfaces={result.surfaces} texts={result.coefficients.map((c) => t`${figure(c)} sd`)} energies={result.relativeEnergy} />,
    shoot: (result) => <Path surfaces={result.surfaces} texts={result.surfaces.map((s, i) => s.name || `${i + 1}`)} energies={result.relativeEnergies} />,
};

export function Results({ job }: { job: api.Job }) {
    const process = job.process as api.ProcessId;
    const loaded = useLoad(() => api.results<typeof process>(job.id), [job.id]);
    return (
        <Shown of={loaded} label={t`results`}>{(result) => {
            const view = VIEWS[process] as ((result: object, job: api.Job) => ComponentChildren) | undefined;
            return (
                <>
                    <div class="results"><Warnings list={result.warnings} />{view ? view(result, job) : <AnyResult result={result} />}</div>
                    <div class="actions">
                        {process !== 'report' && <ReportButton title={job.name || job.process} job={job} />}
                        <button onClick={() => save(`${process}.json`, JSON.stringify(result, null, 2), 'application/json')}>{t`Results as JSON`}</button>
                        {process === 'distances' && <button onClick={async () => save('distances.csv', await (await api.request(`/v1/jobs/${job.id}/results?format=csv`)).blob())}>{t`Matrix as CSV`}</button>}
                    </div>
                </>
            );
        }}</Shown>
    );
}
