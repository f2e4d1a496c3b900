{% import "functions.c" as c with context %}
/* {{ written_by | join("\n   ") | comment }} */
#include "{{ name }}.h"
#include <math.h>

{% for helper in translator.helpers %}
{{ c[helper] }}

{% endfor %}
{% for struct in translator.structs.values() if struct not in in_header %}
{{ c.typedef(struct) }}
{% endfor %}
{% for function, (arguments, result, text, body) in translator.functions.items() %}
/* {{ text | comment }} */
static {{ syntax.type_name(result) }} {{ function }}({{ c.signature(arguments) }}) {
{% for line in body %}
{{ line }}
{% endfor %}
}

{% endfor %}
void {{ name }}_defaults({{ name }}_model *m) {
    m->dt = {{ syntax.number(dt) }};
{% for one in settings %}
    m->parameters.{{ syntax.name(one.name) }} = {{ syntax.number(one.value) }};
{% else %}
    m->parameters.unused = 0.0;
{% endfor %}
}

const char *{{ name }}_refusal(int number) {
    switch (number) {
{% for _, text in refusals %}
    case {{ loop.index }}: return "{{ text }}";
{% endfor %}
    case {{ misfit }}: return "the parameters and the sampling period do not fit together.";
    default: return "";
    }
}

int {{ name }}_start({{ name }}_model *m, {{ c.arguments(start_names) }}) {
{% for test, _ in refusals %}
    if ({{ test }}) return {{ loop.index }};
{% endfor %}
    if (!(m->dt > 0.0)) return {{ misfit }};
{% for one in packed %}
{% if one.function %}
    {
        const {{ syntax.type_name(one.record) }} found = {{ one.function }}(&m->parameters, m->dt);
{% for field, _ in one.record.fields %}
        m->{{ one.name }}[{{ loop.index0 }}] = found.{{ field }};
{% endfor %}
    }
{% endif %}
{% for number in one.constants %}
    m->{{ one.name }}[{{ loop.index0 }}] = {{ syntax.number(number) }};
{% endfor %}
    for (int k = 0; k < {{ one.length }}; k++) if (m->{{ one.name }}[k] != m->{{ one.name }}[k]) return {{ misfit }};
{% endfor %}
{% for array, length in arrays %}
    for (int k = 0; k < {{ length }}; k++) m->{{ array }}[k] = 0.0;
{% endfor %}
    m->state = {{ at_rest.text }};
{% for argument in start_names | idle(at_rest.text, *results) %}
    (void){{ argument }};
{% endfor %}
{% for one in outputs %}
    m->{{ one.name }} = {{ results[loop.index0] }};
{% endfor %}
    return 0;
}

void {{ name }}_step({{ name }}_model *m, {{ c.arguments(inputs | map(attribute="name")) }}) {
{% for argument in inputs | map(attribute="name") | idle(stepped.text) %}
    (void){{ argument }};
{% endfor %}
    m->state = {{ stepped.text }};
{% for one in outputs %}
    m->{{ one.name }} = {{ results[loop.index0] }};
{% endfor %}
}

int {{ name }}_sample(int first, double dt, const double *parameters, const double *inputs,
    const double *before,
    double *memory, double *outputs) {
    union { {{ name }}_model model; double numbers[{{ name | upper }}_MEMORY]; } u;
    int wrong = 0;
    if (first) {
        u.model.dt = dt;
{% for one in settings %}
        u.model.parameters.{{ syntax.name(one.name) }} = parameters[{{ loop.index0 }}];
{% endfor %}
{% if not parameters %}
        (void)parameters;
{% endif %}
        wrong = {{ name }}_start(&u.model, {{ start_arguments("parameters[{}]", "inputs[{}]") | join(", ") }});
    } else {
        for (unsigned k = 0; k < {{ name | upper }}_MEMORY; k++) u.numbers[k] = before[k];
    }
    if (wrong == 0) {{ name }}_step(&u.model, {% for _ in inputs %}inputs[{{ loop.index0 }}]{{ ", " if not loop.last }}{% endfor %});
    for (unsigned k = 0; k < {{ name | upper }}_MEMORY; k++) memory[k] = wrong ? 0.0 : u.numbers[k];
{% for one in outputs %}
    outputs[{{ loop.index0 }}] = wrong ? NAN : u.model.{{ one.name }};
{% endfor %}
    return wrong;
}
