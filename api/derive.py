#!/usr/bin/python3
"""What the daemon serves beside api/openapi.yaml, made from it:

  derive.py json <openapi.yaml   the same in OpenAPI 3.0, as JSON (/v1/openapi.json), with a path for each process
  derive.py html <openapi.yaml   the same as a page (/v1/docs), which fetches nothing

OGC API - Processes 1.0 asks for OpenAPI 3.0. The description is in 3.1, whose schemas are those of JSON Schema
2020-12. Generators of typed clients need 3.0, too, and take types from paths: so the execution of each process has a
path of its own there. This writes the keywords that it uses as 3.0 has them, and stops at one that it does not know.
"""
import copy
import html
import json
import re
import sys

import yaml

# Keywords whose value is a schema, a list of them, and a map of them.
SCHEMA = {'items', 'not', 'additionalProperties'}
SCHEMAS = {'anyOf', 'oneOf', 'allOf'}
KNOWN = SCHEMA | SCHEMAS | {
    'properties', 'type', 'description', 'default', 'required', 'minimum', 'maximum', 'pattern', 'enum', 'minItems',
    'maxItems', 'exclusiveMinimum', 'exclusiveMaximum', 'const', 'uniqueItems', 'title', 'format', 'minLength',
    'maxLength', 'contentMediaType', 'minProperties', 'maxProperties', 'readOnly', 'nullable', 'example', 'examples',
    'discriminator', 'deprecated'}


def without_null(schema):
    """A type null, alone in a list of types or in a choice, as nullable."""
    types = schema.get('type')
    if isinstance(types, list):
        rest = [one for one in types if one != 'null']
        schema.pop('type')
        nullable = {'nullable': True} if 'null' in types else {}
        if len(rest) == 1:
            schema.update({'type': rest[0], **nullable})
        else:
            schema['anyOf'] = [{'type': one, **nullable} for one in rest]
    for choice in ('oneOf', 'anyOf'):
        options = schema.get(choice, [])
        rest = [one for one in options if one.get('type') != 'null']
        if len(rest) < len(options):
            schema[choice] = rest
            for one in rest:
                # 3.0 has nullable beside a type alone.
                if 'type' in one:
                    one['nullable'] = True


def schema30(schema):
    if not isinstance(schema, dict):
        return schema
    if '$ref' in schema:
        others = {name: value for name, value in schema.items() if name != '$ref'}
        return {'allOf': [{'$ref': schema['$ref']}], **schema30(others)} if others else schema
    unknown = set(schema) - KNOWN
    if unknown:
        sys.exit(f'derive.py: OpenAPI 3.0 has no {sorted(unknown)}')
    new = {}
    for name, value in schema.items():
        if name in SCHEMA:
            new[name] = schema30(value)
        elif name in SCHEMAS:
            new[name] = [schema30(one) for one in value]
        elif name == 'properties':
            new[name] = {key: schema30(one) for key, one in value.items()}
        else:
            new[name] = value
    without_null(new)
    if 'const' in new:
        new['enum'] = [new.pop('const')]
    for limit in ('Minimum', 'Maximum'):
        value = new.get('exclusive' + limit)
        if value is not None and not isinstance(value, bool):
            new[limit.lower()] = value
            new['exclusive' + limit] = True
    if new.pop('contentMediaType', None):
        new['type'] = 'string'
        new['format'] = 'binary'
    if not new.get('required', True):
        del new['required']  # 3.0 has no empty list here
    if 'examples' in new:
        new['example'] = new.pop('examples')[0]
    return new


def walk(node):
    """Everything outside schemas, and the schemas in it."""
    if isinstance(node, list):
        return [walk(one) for one in node]
    if not isinstance(node, dict):
        return node
    return {name: schema30(value) if name == 'schema' else walk(value) for name, value in node.items()}


# ---- For typed clients ------------------------------------------------------------------------------------------------

EXECUTION = '/v1/processes/{id}/execution'


def told_default(schema):
    """A default as a sentence: generators take a property that has one for one that is always there."""
    if isinstance(schema, list):
        return [told_default(one) for one in schema]
    if not isinstance(schema, dict):
        return schema
    new = {name: {key: told_default(one) for key, one in value.items()} if name == 'properties' else
           value if name in ('enum', 'default', 'required') else told_default(value)
           for name, value in schema.items()}
    if 'default' in new:
        value = json.dumps(new.pop('default'))
        new['description'] = f'{new.get("description", "")} Default: {value}.'.strip()
    return new


RECORDS = {'surface': 'Surface', 'mesh': 'Mesh', 'model': 'Model'}


def typed_records(outputs):
    """Outputs that are records of a resource, and lists of them, with its schema."""
    for name, schema in outputs['properties'].items():
        one = {'$ref': f'#/components/schemas/{RECORDS.get(name.removesuffix("s"), "")}'}
        if one['$ref'].endswith('/'):
            continue
        if schema.get('type') == 'object':
            outputs['properties'][name] = {'allOf': [one], 'description': schema['description']}
        elif schema.get('type') == 'array':
            schema['items'] = one


def typed_executions(document):
    """One path for each process in the place of that of all, so that the id selects the types."""
    schemas = document['components']['schemas']
    general = document['paths'][EXECUTION]['post']
    ids = [name.removesuffix('Inputs') for name in schemas if name.endswith('Inputs')]
    for name in ids:
        schemas[name + 'Inputs'] = told_default(schemas[name + 'Inputs'])
        typed_records(schemas[name + 'Outputs'])
    for name in ('Execution', 'OutputWanted'):
        schemas[name] = told_default(schemas[name])
    paths = {}
    for path, item in document['paths'].items():
        if path != EXECUTION:
            paths[path] = item
            continue
        for name in ids:
            pascal = ''.join(part.capitalize() for part in name.split('-'))
            execution = copy.deepcopy(schemas['Execution'])
            inputs = execution['properties']['inputs']
            execution['properties']['inputs'] = {'allOf': [{'$ref': f'#/components/schemas/{name}Inputs'}],
                                                 'description': inputs['description']}
            schemas[name + 'Execution'] = execution
            post = copy.deepcopy(general)
            post['operationId'] = 'execute' + pascal
            post['summary'] = f'Run {name}'
            post['parameters'] = [one for one in post['parameters'] if not one['$ref'].endswith('/ProcessId')]
            post['requestBody']['content']['application/json']['schema'] = {
                '$ref': f'#/components/schemas/{name}Execution'}
            # A client with types asks for plain results; those that are framed have no type of the process.
            post['responses']['200']['description'] += ' These are plain ones: openapi.yaml has the others.'
            post['responses']['200']['content'] = {'application/json': {'schema': {
                '$ref': f'#/components/schemas/{name}Outputs'}}}
            post['responses'].pop('204')  # of links alone
            paths[f'/v1/processes/{name}/execution'] = {'post': post}
    document['paths'] = paths


def openapi30(document):
    typed_executions(document)
    components = document['components']
    schemas = {name: schema30(one) for name, one in components.pop('schemas').items()}
    new = walk(document)
    for item in new['paths'].values():
        for operation_ in item.values():
            operation_.setdefault('description', operation_['summary'] + '.')
    new['openapi'] = '3.0.3'
    new['info']['license'] = {'name': new['info']['license']['name'], 'url': 'https://www.gnu.org/licenses/gpl-3.0.html'}
    new['components']['schemas'] = schemas
    return new


# ---- The page ---------------------------------------------------------------------------------------------------------

STYLE = '''body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222}
h1,h2,h3{line-height:1.2}h3{border-top:1px solid #ccc;padding-top:1rem}code{background:#f3f3f3;padding:0 .2em}
table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.2rem .5rem;text-align:left;vertical-align:top}
details{margin:.5rem 0}pre{background:#f3f3f3;padding:.5rem;overflow:auto}.m{font-weight:bold}
@media(prefers-color-scheme:dark){body{background:#181818;color:#ddd}code,pre{background:#2a2a2a}a{color:#8bf}}'''


def row(cells, kind='td'):
    return '<tr>' + ''.join(f'<{kind}>{cell}</{kind}>' for cell in cells) + '</tr>'


def code(text):
    return f'<code>{html.escape(str(text))}</code>'


def resolve(document, node):
    while '$ref' in node:
        found = document
        for part in node['$ref'].removeprefix('#/').split('/'):
            found = found[part]
        node = found
    return node


def linked(schema):
    """The name of a schema, with a link, or what it is."""
    if '$ref' in schema:
        name = schema['$ref'].rsplit('/', 1)[1]
        return f'<a href="#schema-{name}">{name}</a>'
    return code(schema.get('type', 'one of several'))


def operation(document, method, path, one):
    yield f'<h3 id="{one["operationId"]}"><span class="m">{method.upper()}</span> {code(path)}</h3>'
    yield f'<p>{html.escape(one.get("summary", ""))}</p>'
    if 'description' in one:
        yield f'<p>{html.escape(one["description"])}</p>'
    rows = [resolve(document, parameter) for parameter in one.get('parameters', [])]
    if rows:
        yield '<table>' + row(['parameter', 'in', 'meaning'], 'th')
        for parameter in rows:
            yield row([code(parameter['name']), parameter['in'], html.escape(parameter.get('description', ''))])
        yield '</table>'
    for media, content in resolve(document, one.get('requestBody', {})).get('content', {}).items():
        yield f'<p>Body {code(media)}: {linked(content.get("schema", {}))}</p>'
    yield '<table>' + row(['answer', 'meaning', 'content'], 'th')
    for status, answer in one['responses'].items():
        answer = resolve(document, answer)
        content = '<br>'.join(f'{code(media)} {linked(value.get("schema", {}))}'
                              for media, value in answer.get('content', {}).items())
        yield row([status, html.escape(answer.get('description', '')), content])
    yield '</table>'


def page(document):
    info = document['info']
    yield (f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{html.escape(info["title"])}</title>'
           '<meta name="viewport" content="width=device-width"><style>' + STYLE + '</style></head><body>')
    yield f'<h1>{html.escape(info["title"])}</h1><p>{html.escape(info["description"])}</p>'
    yield '<p>For programs: <a href="openapi.yaml">OpenAPI 3.1</a>, <a href="openapi.json">OpenAPI 3.0</a>.</p>'
    operations = [(one, method, path) for path, item in document['paths'].items() for method, one in item.items()]
    for tag in document['tags']:
        yield f'<h2>{html.escape(tag["name"])}</h2><p>{html.escape(tag["description"])}</p>'
        for one, method, path in operations:
            if tag['name'] in one['tags']:
                yield from operation(document, method, path, one)
    yield '<h2>Schemas</h2>'
    for name, schema in document['components']['schemas'].items():
        text = html.escape(yaml.safe_dump(schema, sort_keys=False, allow_unicode=True, width=100))
        yield f'<details id="schema-{name}"><summary>{name}</summary><pre>{text}</pre></details>'
    yield '</body></html>'


class Loader(getattr(yaml, 'CSafeLoader', yaml.SafeLoader)):
    """Reads 1e-13 as a number, as YAML 1.2 does."""


Loader.add_implicit_resolver('tag:yaml.org,2002:float', re.compile(r'^-?[0-9]+(\.[0-9]*)?[eE][-+]?[0-9]+$'),
                             list('-0123456789'))


def main():
    document = yaml.load(sys.stdin, Loader=Loader)
    if sys.argv[1:] == ['json']:
        print(json.dumps(openapi30(document), ensure_ascii=False, separators=(',', ':')))
    elif sys.argv[1:] == ['html']:
        print('\n'.join(page(document)))
    else:
        sys.exit('usage: derive.py json|html <openapi.yaml')


main()
