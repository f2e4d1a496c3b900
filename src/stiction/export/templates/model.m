{% set all_out, all_in = outputs | map(attribute="name") | list + ["m"], inputs | map(attribute="name") | list + ["m"] %}
function [{{ all_out | join(", ") }}] = {{ name }}({{ all_in | join(", ") }}, parameters)
{% for line in written_by %}
% {{ line }}
{% endfor %}
%
% Call it once each sampling period: [{{ all_out | join(", ") }}] = {{ name }}({{ all_in | join(", ") }});
% begin with m = [], and hand m over from call to call.
%
{% for role, row in (("Input", inputs), ("Output", outputs), ("Parameter", parameters)) %}
{% for one in row %}
% {{ role }} {{ one.name }}: {{ one | meaning }}
{% endfor %}
{% endfor %}
if nargin < {{ inputs | length + 2 }}
    parameters = struct({% for one in parameters %}'{{ syntax.name(one.name) }}', {{ syntax.number(one.value) }}{{ ", " if not loop.last }}{% endfor %});
end
if nargin < {{ inputs | length + 1 }} || isempty(m)
    dt = {{ syntax.number(dt) }};
    m = struct('parameters', parameters);
{% for test, text in refusals %}
    if {{ test }}
        error('{{ name }}:parameters', '%s', '{{ text | replace("'", "") }}');
    end
{% endfor %}
{% for one in packed %}
{% if one.function %}
    found = {{ one.function }}(parameters, dt);
{% endif %}
    m.{{ one.name }} = {% if one.function %}[{% for field, _ in one.record.fields %}found.{{ field }}{{ ", " if not loop.last }}{% endfor %}]{% else %}[{% for number in one.constants %}{{ syntax.number(number) }}{{ ", " if not loop.last }}{% endfor %}]{% endif %};
    if any(isnan(m.{{ one.name }}))
        error('{{ name }}:parameters', '%s', 'the parameters and the sampling period do not fit together.');
    end
{% endfor %}
{% for argument, text in start_arguments("parameters.{1}", "{1}") | zip(start_names) if argument != text %}
    {{ text }} = {{ argument }};
{% endfor %}
    m.state = {{ at_rest.text }};
end
m.state = {{ stepped.text }};
{% for one in outputs %}
{{ one.name }} = {{ results[loop.index0] }};
{% endfor %}
end
{% for function, (arguments, _, text, body) in translator.functions.items() %}

function result = {{ function }}({{ arguments | map("first") | join(", ") }})
% {{ text }}
{% for line in body %}
{{ line }}
{% endfor %}
end
{% endfor %}
{% for helper in translator.helpers %}

{% if helper == "choose" %}
function y = choose(c, a, b)
if c
    y = a;
else
    y = b;
end
end
{% elif helper == "copysign" %}
function y = copysign(x, s)
if s < 0 || (s == 0 && 1 / s < 0)
    y = -abs(x);
else
    y = abs(x);
end
end
{% else %}
function y = round_even(x)
y = round(x);
if abs(x - fix(x)) == 0.5
    y = 2 * round(x / 2);
end
end
{% endif %}
{% endfor %}
