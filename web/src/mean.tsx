// The mean of a group: its members around it, the way to it, and landmarks of the group.
import type * as api from './api';
import { Curve } from './charts';
import { GroupLandmarks, MemberDistances, hasDistances, isMet, leftAt } from './charts_group';
import { t } from './i18n';
import { aPlace, maybe, useKept } from './kept';
import { Marked, useGround } from './landmarks';
import type { Ground, Place } from './landmarks';
import { Linked } from './paths';
import { link } from './router';
import { Shape, linked, surfacePath, useShape } from './shape';
import { FORMATS, figure, plural } from './ui';

const LISTED_MAX = 500;

export const idsOf = (result: any, job?: api.Job): string[] => result.inputs?.cohort?.surfaces ?? result.inputs?.surfaces ?? job?.inputs?.surfaces ?? [];

// ---- Landmarks -----------------------------------------------------------------------------------------------------

/** Those of a member as they were given: one list for all, or one for each. */
function placesOf(given: any, member: number): Place[] {
    return given?.vertices ?? given?.points?.[member] ?? [];
}

function MarkedMember({ id, title, places }: { id: string; title: string; places: Place[] }) {
    const { ground } = useGround(id);
    return (
        <figure class="shape">
            {ground ? <Marked ground={ground} places={places} label={title} /> : <div class="view" aria-busy="true" />}
            <figcaption>{t`${title}, as its landmarks were given`}</figcaption>
        </figure>
    );
}

function MarkedMean({ id, points }: { id: string; points: { position: number[] }[] }) {
    const { shape } = useShape(`${surfacePath(id, 32)}&space=original`);
    const ground: Ground | undefined = shape && { shape, vertices: false };
    return (
        <figure class="shape">
            {ground ? <Marked ground={ground} places={points.map((p) => p.position)} label={t`Mean`} camera={linked} /> : <div class="view" aria-busy="true" />}
            <figcaption>{t`The mean, with the landmarks on it`}</figcaption>
        </figure>
    );
}

/** What the registrations to the mean left at each landmark, over the members and for each of them. */
export function LandmarksOfGroup({ result, surface, ids }: { result: any; surface: string; ids: string[] }) {
    const found = result.landmarks;
    const [chosen, setChosen] = useKept('member', 0, aPlace(found?.members.length ?? 0));
    if (!found) return null;
    const labels: string[] = result.labels ?? ids;
    const given = result.inputs?.landmarks;
    return (
        <section aria-label={t`Landmarks`}>
            <h2>{t`Landmarks`}</h2>
            {found.guiding && <p>{t`Guided by ${plural(found.guiding.count, 'landmark')}, ${leftAt(found.guiding)}${found.weight === 'exact' ? '' : t`; weight ${figure(found.weight)}`}.`}</p>}
            {found.heldOut && <p><strong>{t`Held out: ${plural(found.heldOut.count, 'landmark')}, ${leftAt(found.heldOut)}.`}</strong> {t`The registrations did not see these: they tell how well members correspond elsewhere.`}</p>}
            <div class="split">
                <GroupLandmarks points={found.points} />
                <MarkedMean id={surface} points={found.points} />
                {ids[chosen] && given && <MarkedMember key={chosen} id={ids[chosen]} title={labels[chosen]} places={placesOf(given, chosen)} />}
            </div>
            <div class="scroll" tabIndex={0} role="region" aria-label={t`Distances at the landmarks of each member`}><table>
                <thead><tr><th scope="col">{t`Member`}</th>{found.points.map((p: any, i: number) => <th scope="col">{t`Landmark ${i + 1}${p.heldOut ? t` (held out)` : ''}`}</th>)}</tr></thead>
                <tbody>{found.members.slice(0, LISTED_MAX).map((m: any, i: number) => (
                    <tr><td><button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{labels[i]}</button></td>
                        {m.distances.map((d: number | null, k: number) => <td>{isMet(m.angles[k]) ? 0 : figure(d)}</td>)}</tr>
                ))}</tbody>
            </table></div>
            <p class="quiet">{t`Distances are straight lines between points of the member, in the units of its file.`}</p>
        </section>
    );
}

// ---- The mean ------------------------------------------------------------------------------------------------------

function wayTo(result: api.Outputs<'mean'>): string {
    if (!result.registration) return t`of the surfaces as they are parameterized: none was registered`;
    const { iterations } = result;
    return result.converged ? t`found after ${plural(iterations, 'iteration')}` : t`not reached after ${plural(iterations, 'iteration')}: it is shown as it was then`;
}

export function Mean({ result, job }: { result: api.Outputs<'mean'>; job: api.Job }) {
    const [chosen, setChosen] = useKept('chosen', undefined, maybe(aPlace(result.labels.length)));
    const ids = idsOf(result, job);
    const { pullback } = result;
    const whole = hasDistances(result);
    const name = result.surface.name || 'mean';
    const button = (i: number) => <button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{result.labels[i]}</button>;
    const rows: [string, string][] = [
        [t`Degree`, `${result.surface.lmax}`],
        [t`Relative energy`, t`${figure(result.relativeEnergy, 2)} (0: the mean of the fields is that of a shape)`],
        ...(pullback ? [[t`Mean squared length of geodesics`, figure(pullback.variance, 4)], [t`Mean of the logarithms`, t`${figure(pullback.meanVelocity, 2)} (0 at a minimum)`], [t`From the mean of the fields`, figure(pullback.moved)]] as [string, string][] : []),
    ];
    return (
        <>
            <p class="big">{t`Mean of ${plural(result.labels.length, 'shape')}`} <span class={result.converged ? 'quiet' : 'wrong'}>{wayTo(result)}</span></p>
            <div class="split">
                <div>
                    <Shape src={surfacePath(result.surface.id, 32)} label={t`The mean`} name={name} downloads={FORMATS.map((f) => [f, `/v1/surfaces/${result.surface.id}/mesh?format=${f}&resolution=48`])} />
                    <dl class="pairs">{rows.map(([title, text]) => <><dt>{title}</dt><dd>{text}</dd></>)}</dl>
                    <div class="actions no-report"><a class="button" href={link('shapes', result.surface.id)}>{t`Open, download`}</a></div>
                </div>
                <div>
                    {whole && <MemberDistances result={result} chosen={chosen} onChoose={setChosen} />}
                    {chosen === undefined && <p class="quiet no-report">{t`Choose a member to see it beside the mean.`}</p>}
                </div>
                {chosen !== undefined && ids[chosen] && <Linked key={chosen} id={ids[chosen]} title={t`${result.labels[chosen]}${result.groups?.[chosen] ? ` (${result.groups[chosen]})` : ''}, ${figure(result.distances[chosen])} from the mean`} />}
                {result.history.length > 2 && <Curve title={t`What is minimized, by iteration`} name="history" labels={[t`iteration`, t`objective`]}
                    points={result.history.map((h: any) => ({ x: h.iteration, y: h.objective }))} />}
            </div>
            <LandmarksOfGroup result={result} surface={result.surface.id} ids={ids} />
            <h2>{t`Members`}</h2>
            <div class="scroll" tabIndex={0} role="region" aria-label={t`Members and their distances`}><table>
                <thead><tr><th scope="col">{t`Member`}</th>{result.groups && <th scope="col">{t`Label`}</th>}<th scope="col">{t`Distance from the mean`}</th></tr></thead>
                <tbody>{result.labels.slice(0, LISTED_MAX).map((_, i) => (
                    <tr><td>{button(i)}</td>{result.groups && <td>{result.groups[i] ?? '–'}</td>}<td>{figure(result.distances[i], 4)}</td></tr>
                ))}</tbody>
            </table></div>
            {result.labels.length > LISTED_MAX && <p class="quiet">{t`and ${result.labels.length - LISTED_MAX} more: they are in the results as JSON.`}</p>}
            {!whole && <p class="quiet">{t`No distance is known of ${plural(result.distances.filter((d) => d === null).length, 'member')}.`}</p>}
        </>
    );
}
