// The nearest of each member: a list to search, and the shapes of a member and of those nearest to it.
import { useMemo } from 'preact/hooks';
import type * as api from './api';
import { NeighbourCharts, nameAt } from './charts_joint';
import { t, whole } from './i18n';
import { aPlace, aText, useKept } from './kept';
import { Linked } from './paths';
import { LongTable, csv, figure, plural, save } from './ui';

const SHAPES = 6;

export function Neighbours({ result, job }: { result: api.Outputs<'neighbours'>; job: api.Job }) {
    const [chosen, setChosen] = useKept('chosen', 0, aPlace(result.labels.length));
    const [find, setFind] = useKept('find', '', aText);
    const pairs: any = result.pairs;
    const indices = result.indices as number[][];
    const distances = result.distances as number[][];
    const ids: string[] = result.inputs?.cohort?.surfaces ?? result.inputs?.surfaces ?? job.inputs?.surfaces ?? [];
    const members = useMemo(() => result.labels.map((label, i) => ({ i, label })).filter((m) => m.label.toLowerCase().includes(find.toLowerCase())), [result, find]);
    const group = (i: number): string => (result.groups?.[i] ? ` (${result.groups[i]})` : '');
    const button = (i: number) => <button class="plain-button" aria-pressed={i === chosen} onClick={() => setChosen(i)}>{nameAt(result, i)}</button>;
    return (
        <>
            <p class="quiet">{t`${plural(result.labels.length, 'member')}, the ${indices[0].length === 1 ? t`nearest` : t`${indices[0].length} nearest`} of each; ${whole(pairs.registered)} of ${plural(pairs.all, 'pair')} had to be registered.`}</p>
            <div class="split">
                <div>
                    <div class="row tools no-report"><label>{t`Search`} <input type="search" value={find} onInput={(e) => setFind(e.currentTarget.value)} /></label>
                        <button onClick={() => save('neighbours.csv', csv([['member', 'rank', 'neighbour', 'distance'], ...indices.flatMap((row, i) => row.map((j, k) => [nameAt(result, i), k + 1, nameAt(result, j), distances[i][k]]))]), 'text/csv;charset=utf-8')}>{t`CSV`}</button></div>
                    <LongTable label={t`Members and their nearest`} items={members} keyOf={(m) => `${m.i}`}
                        columns={[{ title: t`Member` }, { title: t`Nearest` }, { title: t`Distance`, width: '6rem' }]}
                        row={({ i }) => [<>{button(i)}{group(i)}</>, <>{button(indices[i][0])}{group(indices[i][0])}</>, figure(distances[i][0])]} />
                </div>
                <NeighbourCharts result={result} chosen={chosen} onChoose={setChosen} />
            </div>
            <h2>{t`${nameAt(result, chosen)}${group(chosen)} and those nearest to it`}</h2>
            <div class="gallery">
                {ids[chosen] && <Linked key={`own ${chosen}`} id={ids[chosen]} title={nameAt(result, chosen)} />}
                {indices[chosen].slice(0, SHAPES).map((j, k) => ids[j] && (
                    <div key={`${chosen} ${k}`}><Linked id={ids[j]} title={`${k + 1}: ${nameAt(result, j)}${group(j)}, ${figure(distances[chosen][k])}`} /><span class="no-report">{button(j)}</span></div>
                ))}
            </div>
            {indices[chosen].length > SHAPES && <ol start={SHAPES + 1}>{indices[chosen].slice(SHAPES).map((j, k) => <li>{button(j)}{group(j)} {figure(distances[chosen][k + SHAPES])}</li>)}</ol>}
        </>
    );
}
