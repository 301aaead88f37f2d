model ThreeTank "three tanks in a row, T1, T3, T2, joined by valves, an outlet at T2, pumps into T1 and T2"
  // Units are those of the record.
  parameter Real pump_gain_1(min=0) = 3.4 "inflow for one unit of the command to pump 1";
  parameter Real pump_gain_2(min=0) = 3.1 "inflow for one unit of the command to pump 2";
  parameter Real az13(min=0) = 9 "flow coefficient of the valve between T1 and T3";
  parameter Real az32(min=0) = 9 "flow coefficient of the valve between T3 and T2";
  parameter Real az20(min=0) = 12 "flow coefficient of the outlet of T2";
  final parameter Real area_1(min=0) = 1 "cross-sections; 1 where they are not known";
  final parameter Real area_3(min=0) = 1;
  final parameter Real area_2(min=0) = 1;
  final parameter Real orifice(min=0) = 1 "cross-section of the pipes times sqrt(2 g); 1 where it is not known";
  final parameter Real width(min=0) = 2e-3 "heads below this one flow laminar: 1e-4 of the largest level that is read";
  constant Real w = 1e-4 "below this level a parabola stands for the outlet's root";
  input Real u1 "command to pump 1";
  input Real u2 "command to pump 2";
  Real level_1(quantity="Level", start=15);
  output Real level_3(quantity="Level", start=11);
  Real level_2(quantity="Level", start=8);
  Real q13 = orifice*az13*(if level_1 - level_3 >= width then sqrt(level_1 - level_3) elseif level_1 - level_3 <= -width then -sqrt(level_3 - level_1) else (level_1 - level_3)/width*(45 - 18*((level_1 - level_3)/width)^2 + 5*((level_1 - level_3)/width)^4)*sqrt(width)/32);
  Real q32 = orifice*az32*(if level_3 - level_2 >= width then sqrt(level_3 - level_2) elseif level_3 - level_2 <= -width then -sqrt(level_2 - level_3) else (level_3 - level_2)/width*(45 - 18*((level_3 - level_2)/width)^2 + 5*((level_3 - level_2)/width)^4)*sqrt(width)/32);
  Real q20 = orifice*az20*(if level_2 >= w then sqrt(level_2) elseif level_2 > 0 then (1.5 - 0.5*level_2/w)*level_2/sqrt(w) else 0);
equation
  area_1*der(level_1) = pump_gain_1*u1 - q13;
  area_3*der(level_3) = q13 - q32;
  area_2*der(level_2) = pump_gain_2*u2 + q32 - q20;
end ThreeTank;
