// description.cjs - an OpenAPI 3.1 description as a list of operations, and the judge of single values.
//
// load(modules, text) reads the YAML, resolves the references of parameters and responses, and compiles
// schemas when they are first asked for, by Ajv in the dialect of JSON Schema 2020-12, which is that of
// OpenAPI 3.1. Each operation is
//
//   { id, method, path, parameters: [{ name, in, required, schema }], body: { media: schema } | null,
//     responses: { '200' | '4XX': { media: schema } } }
//
// Values of a path, a query and a header are text: textual() says what they mean to a schema that asks
// for a number. Formats (date-time) are not checked.
'use strict';

const METHODS = ['get', 'post', 'put', 'patch', 'delete'];

function media(content) {
    return Object.fromEntries(Object.entries(content || {}).map(([type, of]) => [type, of.schema]));
}

function load(modules, text) {
    const document = modules('js-yaml').load(text);
    const Ajv = modules('ajv/dist/2020').default;
    const ajv = new Ajv({ strict: false, validateFormats: false, allErrors: false });
    const compiled = new Map();

    ajv.addSchema({ $id: 'openapi', components: document.components });

    function resolve(node) {
        while (node && node.$ref) {
            node = node.$ref.slice(2).split('/').reduce((at, name) => at[name], document);
        }
        return node;
    }

    // References are those of the document, also where a schema is compiled on its own.
    function absolute(schema) {
        if (Array.isArray(schema)) {
            return schema.map(absolute);
        }
        if (!schema || typeof schema !== 'object') {
            return schema;
        }
        return Object.fromEntries(
            Object.entries(schema).map(([name, value]) => [
                name,
                name === '$ref' ? `openapi${value}` : absolute(value),
            ])
        );
    }

    // null where the value fits the schema, else a sentence.
    function fault(schema, value) {
        if (!compiled.has(schema)) {
            compiled.set(schema, ajv.compile(absolute(schema)));
        }
        const validate = compiled.get(schema);
        return validate(value) ? null : ajv.errorsText(validate.errors);
    }

    // What the text of a parameter means to its schema.
    function textual(schema, value) {
        if (schema.type === 'boolean' && /^(true|false)$/.test(value)) {
            return value === 'true';
        }
        if (schema.type === 'array') {
            return value.split(',');
        }
        return schema.type === 'integer' && /^-?[0-9]+$/.test(value) ? Number(value) : value;
    }

    const operations = [];
    for (const [path, item] of Object.entries(document.paths)) {
        for (const method of METHODS.filter((name) => item[name])) {
            const operation = item[method];
            const responses = Object.entries(operation.responses).map(([status, response]) => [
                status,
                media(resolve(response).content),
            ]);
            operations.push({
                id: operation.operationId,
                method: method.toUpperCase(),
                path,
                parameters: (operation.parameters || []).map(resolve),
                body: operation.requestBody ? media(resolve(operation.requestBody).content) : null,
                responses: Object.fromEntries(responses),
            });
        }
    }
    return { document, operations, resolve, fault, textual, schemas: document.components.schemas };
}

// The documented response of a status: its own, or that of its class.
function documented(operation, status) {
    return operation.responses[status] || operation.responses[`${Math.floor(status / 100)}XX`] || null;
}

module.exports = { load, documented };
