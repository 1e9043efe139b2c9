// Texts of the dashboard: which of them pass through t`...` (src/i18n.ts), and so can be in another language.
//
//   NODE_PATH=build/web/node_modules node web/texts.mjs           those that do not, as FILE:LINE: TEXT
//   NODE_PATH=build/web/node_modules node web/texts.mjs --list    all that do, as JSON to translate
//
// What looks like a text and is none has its line in web/no-texts.txt.
import { createRequire } from 'node:module';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const web = dirname(fileURLToPath(import.meta.url));
const modules = resolve(process.env.NODE_PATH ?? join(web, '../build/web/node_modules'));
export const ts = createRequire(join(modules, '_.js'))('typescript');

/** What translates, and the frame of reports, which are in English as the service writes them. */
const OTHER_FILES = ['i18n.ts', 'language.ts', 'longer.ts', 'report_view.tsx', 'report_stage.ts', 'report.ts'];

/** Attributes that are read by people; those that never are; all others are judged by how they look. */
const TEXT_ATTRIBUTES = new Set(['aria-label', 'title', 'label', 'labels', 'placeholder', 'question', 'what', 'text', 'texts', 'columns', 'rows', 'facts', 'against', 'of']);
const OTHER_ATTRIBUTES = new Set(['class', 'className', 'href', 'src', 'id', 'for', 'name', 'key', 'type', 'role', 'd', 'viewBox', 'transform', 'style', 'fill', 'stroke', 'kind', 'first', 'kept',
    'downloads', 'files', 'list', 'step', 'min', 'max', 'value', 'points', 'process', 'x', 'y', 'font-size', 'text-anchor', 'scope', 'unit', 'mesh', 'camera', 'accept', 'colour', 'over', 'inputMode', 'autocomplete']);
/** Calls whose arguments are no texts: files, addresses, names of the service. */
const OTHER_CALLS = /^(t|plural|link|go|csv|save|keep|keptText|useKept|oneOf|aText|querySelector|querySelectorAll|closest|addEventListener|removeEventListener|getContext|createElement|setAttribute|getAttribute|includes|startsWith|endsWith|split|replace|replaceAll|match|test|get|set|has|delete|append|api|send|run|execute|list|listAll|request|bytes|results|fetch|RegExp|Set|Map|Blob|URL|getItem|setItem|removeItem|indexOf|join|localeCompare|toLocaleString|matches|import|getEntriesByName)$/;
const OTHER_KEYS = new Set(['class', 'type', 'method', 'kind', 'href', 'scale', 'unit', 'code', 'process', 'width', 'colour', 'mode', 'credentials', 'cache', 'headers', 'id', 'name']);

export const sources = () => readdirSync(join(web, 'src')).filter((f) => /\.tsx?$/.test(f) && !/\.d\.ts$/.test(f) && !OTHER_FILES.includes(f)).sort();
export const parse = (file, text = readFileSync(join(web, 'src', file), 'utf8')) =>
    ts.createSourceFile(file, text, ts.ScriptTarget.ES2022, true, file.endsWith('x') ? ts.ScriptKind.TSX : ts.ScriptKind.TS);

const hasWord = (text) => /\p{L}{2}/u.test(text.replace(/\$\{\}/g, ' '));
const looksLikeText = (text) => hasWord(text) && (/^[A-Z][a-z]+$/.test(text) || /\p{L}{2,}[,:.]? \p{L}|\p{L}{2,}[,:.]? \$\{\}|\$\{\}[,:.]? \p{L}{2}/u.test(text));
/** A literal as it reads, its values as ${}. */
export const reads = (node) => (ts.isTemplateExpression(node) ? node.head.text + node.templateSpans.map((s) => `\${}${s.literal.text}`).join('') : node.text);
export const isLiteral = (node) => ts.isStringLiteral(node) || ts.isNoSubstitutionTemplateLiteral(node) || ts.isTemplateExpression(node);

const calledName = (node) => {
    const callee = node.expression;
    if (ts.isPropertyAccessExpression(callee)) return ts.isCallExpression(node) && ts.isIdentifier(callee.expression) && callee.expression.text === 'api' ? 'api' : callee.name.text;
    return ts.isIdentifier(callee) ? callee.text : callee.kind === ts.SyntaxKind.ImportKeyword ? 'import' : '';
};

/** 'text', 'none', or 'looks': by what is around a literal. */
function around(node) {
    for (let child = node, at = node.parent; at; child = at, at = at.parent) {
        if (ts.isTaggedTemplateExpression(at)) return 'none';
        if (ts.isTypeNode(at) || ts.isImportDeclaration(at) || ts.isExportDeclaration(at) || ts.isLiteralTypeNode(at)) return 'none';
        if (ts.isElementAccessExpression(at) && at.argumentExpression === child) return 'none';
        if (ts.isCaseClause(at) && at.expression === child) return 'none';
        if (ts.isConditionalExpression(at) && at.condition === child) return 'none';
        if (ts.isBinaryExpression(at)) {
            const kind = at.operatorToken.kind;
            const S = ts.SyntaxKind;
            if ([S.EqualsEqualsEqualsToken, S.ExclamationEqualsEqualsToken, S.EqualsEqualsToken, S.InKeyword, S.LessThanToken, S.GreaterThanToken].includes(kind)) return 'none';
            if (kind === S.AmpersandAmpersandToken && at.left === child) return 'none';
            if (kind === S.EqualsToken && at.right === child && ts.isPropertyAccessExpression(at.left) && !/^(title|textContent|detail)$/.test(at.left.name.text)) return 'none';
        }
        if ((ts.isPropertyAssignment(at) || ts.isPropertySignature(at) || ts.isPropertyDeclaration(at)) && at.name === child) return 'none';
        if (ts.isPropertyAssignment(at) && OTHER_KEYS.has(at.name.getText())) return 'none';
        if ((ts.isCallExpression(at) || ts.isNewExpression(at)) && at.arguments?.includes(child)) {
            if (OTHER_CALLS.test(calledName(at)) && !(calledName(at) === 'set' && at.expression.getText() !== 'x')) return 'none';
            return 'looks';
        }
        if (ts.isParameter(at)) return 'none';
        if (ts.isJsxAttribute(at)) {
            const name = at.name.getText();
            return TEXT_ATTRIBUTES.has(name) ? 'text' : OTHER_ATTRIBUTES.has(name) || /^(on|data-|stroke|font)/.test(name) ? 'none' : 'looks';
        }
        if (ts.isJsxExpression(at) && (ts.isJsxElement(at.parent) || ts.isJsxFragment(at.parent))) return 'text';
        if (ts.isExpressionStatement(at)) return 'none';
        if (ts.isStatement(at) || ts.isVariableDeclaration(at) || ts.isSourceFile(at)) return 'looks';
    }
    return 'looks';
}

export function isText(node) {
    const text = reads(node);
    if (!hasWord(text)) return false;
    const what = around(node);
    return what === 'text' ? !/^[a-z]+[A-Z-]/.test(text) || / /.test(text) : what === 'looks' && looksLikeText(text);
}

/** A text of JSX as it is shown: lines are joined, what is between elements and lines is not. */
export function shownText(node) {
    const lines = node.text.split('\n');
    return lines.map((line, i) => {
        let part = line.replace(/\t/g, ' ');
        if (i > 0) part = part.trimStart();
        if (i < lines.length - 1) part = part.trimEnd();
        return part;
    }).filter(Boolean).join(' ');
}

function look(file, told) {
    const source = parse(file);
    const visit = (node) => {
        if (isLiteral(node) && isText(node)) told(file, source.getLineAndCharacterOfPosition(node.getStart()).line + 1, reads(node));
        if (ts.isJsxElement(node) && /^(code|kbd)$/.test(node.openingElement.tagName.getText())) return; // what is typed
        if (ts.isJsxText(node) && hasWord(node.text)) told(file, source.getLineAndCharacterOfPosition(node.getStart()).line + 1, shownText(node).trim());
        ts.forEachChild(node, visit);
    };
    visit(source);
}

/** English texts as t`...` and plural() have them: values are {0}, {1} and so on. */
function listed() {
    const found = new Set();
    for (const file of sources()) {
        const visit = (node) => {
            if (ts.isTaggedTemplateExpression(node) && node.tag.getText() === 't') {
                let n = 0;
                found.add(reads(node.template).replace(/\$\{\}/g, () => `{${n++}}`));
            }
            if (ts.isCallExpression(node) && node.expression.getText() === 'plural') {
                const [, one, many] = node.arguments;
                if (one && ts.isStringLiteral(one)) found.add(`{0} ${one.text}|{0} ${many && ts.isStringLiteral(many) ? many.text : `${one.text}s`}`);
            }
            ts.forEachChild(node, visit);
        };
        visit(parse(file));
    }
    return [...found].sort();
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    if (process.argv.includes('--list')) {
        process.stdout.write(`${JSON.stringify(Object.fromEntries(listed().map((text) => [text, ''])), null, 4)}\n`);
    } else {
        const path = join(web, 'no-texts.txt');
        const none = new Set(existsSync(path) ? readFileSync(path, 'utf8').split('\n').filter((line) => line && !line.startsWith('#')) : []);
        const used = new Set();
        for (const file of sources()) {
            look(file, (of, line, text) => {
                const key = `${of}: ${text.replace(/\s+/g, ' ')}`;
                if (none.has(key)) used.add(key);
                else process.stdout.write(`web/src/${of}:${line}: ${text.replace(/\s+/g, ' ')}\n`);
            });
        }
        for (const key of none) if (!used.has(key)) process.stdout.write(`web/no-texts.txt:1: is not there any more: ${key}\n`);
    }
}
