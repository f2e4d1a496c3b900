{% set header %}{% include "model.h" %}{% endset %}
{% set source %}{% include "model.c" %}{% endset %}
{% set source = source | replace('#include "' ~ name ~ '.h"\n', header) %}
// {{ written_by[1] | modelica }}
// {{ written_by[2] | modelica }}
block {{ name }} "{{ title | modelica }}"
{% for one in parameters %}
  parameter Real {{ one.name }}
{%- if one.low | finite or one.high | finite %}(
{%- if one.low | finite %}min = {{ one.low | real }}{{ ", " if one.high | finite }}{% endif %}
{%- if one.high | finite %}max = {{ one.high | real }}{% endif %})
{%- endif %} = {{ one.value | real }} "{{ one | meaning | modelica }}";
{% endfor %}
  constant Real dt(unit="s") = {{ dt | real }} "Sampling period [s]";
{% for one in inputs %}
  Modelica.Blocks.Interfaces.RealInput {{ one.name }} "{{ one | meaning | modelica }}";
{% endfor %}
{% for one in outputs %}
  Modelica.Blocks.Interfaces.RealOutput {{ one.name }} "{{ one | meaning | modelica }}";
{% endfor %}
protected
  discrete Real memory[{{ memory_length }}](each start = 0.0, each fixed = true) "State of the model";
  discrete Real y[{{ outputs | length }}] "Outputs";
  discrete Integer samples(start = 0, fixed = true) "Samples until now";
  discrete Integer wrong(start = 0, fixed = true) "Number of what is wrong with the parameters";

  function sample_model "One sample of the model"
    input Integer first "1 at the start";
    input Real dt "Sampling period [s]";
    input Real parameters[{{ [parameters | length, 1] | max }}];
    input Real inputs[{{ inputs | length }}];
    input Real before[{{ memory_length }}];
    output Integer wrong;
    output Real memory[{{ memory_length }}];
    output Real outputs[{{ outputs | length }}];
    external "C" wrong = {{ name }}_sample(first, dt, parameters, inputs, before, memory, outputs)
      annotation(Include = "#ifndef {{ name | upper }}_C
#define {{ name | upper }}_C
{{ source | replace("\\", "\\\\") | replace('"', '\\"') }}#endif
");
  end sample_model;

equation
  when sample(0, dt) then
    samples = pre(samples) + 1;
    (wrong, memory, y) = sample_model(if pre(samples) == 0 then 1 else 0, dt,
      { {{- parameters | join(", ", "name") or "0.0" -}} },
      { {{- inputs | join(", ", "name") -}} }, pre(memory));
  end when;
  assert(wrong == 0, "{{ name }}: a parameter is out of its range, or parameters do not fit together.");
{% for one in outputs %}
  {{ one.name }} = y[{{ loop.index }}];
{% endfor %}
end {{ name }};
